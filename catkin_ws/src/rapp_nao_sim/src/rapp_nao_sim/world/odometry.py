"""Where the robot believes to be: dead reckoning by its legs' joint sensors, wrong by as much as its feet slip. Pure."""

import math
from collections.abc import Mapping

from rapp_nao_sim.world import legs
from rapp_nao_sim.world.poses import Pose, between, compose, inverse


def step(support: str, angles: Mapping[str, float]) -> Pose:
    """The other sole seen from a sole that is flat on the floor."""
    here = legs.sole(support, angles)
    there = legs.sole("R" if support == "L" else "L", angles)
    x, y, _ = here.rotation.T @ (there.position - here.position)
    heading = here.rotation.T @ there.rotation[:, 0]
    return (float(x), float(y), math.atan2(heading[1], heading[0]))


class Odometry:
    """Pose of the middle of the soles, in the frame where the robot was first."""

    def __init__(self) -> None:
        self.pose: Pose = (0.0, 0.0, 0.0)
        self._support: str | None = None
        self._foot: Pose = (0.0, 0.0, 0.0)  # of the sole that is believed to stay

    def begin(self, angles: Mapping[str, float]) -> None:
        """A walk begins: what changed since the last one moved the robot nowhere."""
        self._support = "R"
        half = between((0.0, 0.0, 0.0), step("R", angles), 0.5)
        self._foot = compose(self.pose, inverse(half))

    def follow(self, support: str, angles: Mapping[str, float]) -> None:
        """Joints of the walk, and the foot that carries it."""
        if self._support is None:
            self.begin(angles)
        elif support != self._support:
            self._foot = compose(self._foot, step(self._support, angles))
            self._support = support
        self.pose = compose(self._foot, between((0.0, 0.0, 0.0), step(support, angles), 0.5))
