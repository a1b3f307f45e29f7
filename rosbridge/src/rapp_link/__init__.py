"""The link: the robot's HOP program, the only process on the robot that talks to the Internet (deliverable §4.4, Fig. 10).

roslibpy towards rosbridge on one side; HOP towards the platform and SMTP towards the mail server on the other.
Errors are those of `rapp_hop.errors`: their wire words are the link's too.
"""
