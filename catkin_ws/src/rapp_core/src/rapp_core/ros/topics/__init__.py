"""What the robot's body and cameras publish for others to watch: only while somebody subscribes, and never to steer by."""
