"""Where the robot is in the map: the core agent keeps what it was told, and goes on by the robot's odometry (REP 105)."""

import threading
from dataclasses import dataclass

from rapp_core.body_ports import Pose2D
from rapp_core.geometry import compose, inverse

FRAMES = ("map", "odom", "base_link")


@dataclass(frozen=True)
class Waypoint:
    """A pose to walk to, in one of `FRAMES`; base_link is that of the start."""

    frame: str
    pose: Pose2D


class Place:
    """The pose of odom in map; until somebody tells, both are the same."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._odom = Pose2D(0.0, 0.0, 0.0)

    @property
    def odom(self) -> Pose2D:
        """Pose of odom in map."""
        with self._lock:
            return self._odom

    def tell(self, in_map: Pose2D, in_odom: Pose2D) -> None:
        """The robot, which odometry has at `in_odom`, is at `in_map`."""
        with self._lock:
            self._odom = compose(in_map, inverse(in_odom))

    def in_map(self, in_odom: Pose2D) -> Pose2D:
        """A pose in odom, in map."""
        return compose(self.odom, in_odom)

    def in_odom(self, waypoint: Waypoint, start: Pose2D) -> Pose2D:
        """A waypoint in odom, where base_link is at `start`."""
        if waypoint.frame == "odom":
            return waypoint.pose
        return compose(start if waypoint.frame == "base_link" else inverse(self.odom), waypoint.pose)
