"""rosbridge v2 on ROS 1: protocol and session without I/O, ROS on one side, WebSocket clients on the other."""
