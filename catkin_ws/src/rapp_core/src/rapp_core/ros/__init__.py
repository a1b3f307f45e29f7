"""The ROS side of the core agent: the only place with rospy."""
