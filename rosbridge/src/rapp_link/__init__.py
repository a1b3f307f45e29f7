"""The link: the robot's HOP program, and the only process on the robot that talks to the Internet (deliverable Fig. 10)."""
