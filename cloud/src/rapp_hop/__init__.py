"""HOP: a Python function bound to a URL, the client that calls it, and the packages (HZ) that travel through it.

Knows no ROS and no robot (deliverable §4.4: HOP is the way between robot and platform).
"""
