"""Places of the robot as RApps give and get them. Frames are REP 105's, units REP 103's."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Pose:
    """A pose on the ground: x and y in m, theta in rad, anticlockwise; in frame map unless it is a step of a path that says so.

    Frame "map" is the one `navigation.set_global_pose` tells of, "odom" begins where the robot was switched on, "base_link" is the
    robot: x ahead, y to the left.
    """

    x: float
    y: float
    theta: float = 0.0
    frame: str = "map"
