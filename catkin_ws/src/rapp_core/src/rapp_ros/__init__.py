"""What every ROS node of ours needs and rospy lacks: bounded questions to the master, and surviving its restart."""
