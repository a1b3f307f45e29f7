"""The time of day as ROS has it: simulated time when the graph uses it."""

import time

import rospy


def now() -> tuple[int, int]:
    """Seconds and nanoseconds."""
    if rospy.rostime.is_rostime_initialized() and not rospy.rostime.is_wallclock():
        simulated = rospy.get_rostime()
        return simulated.secs, simulated.nsecs
    return divmod(time.time_ns(), 1_000_000_000)
