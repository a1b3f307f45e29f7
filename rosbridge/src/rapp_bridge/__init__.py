"""rosbridge v2 on ROS 1: protocol and session without I/O, rospy on one side, a Tornado WebSocket server on the other."""
