"""Poses on the floor: x and y in m, heading in rad."""

import math

Pose = tuple[float, float, float]


def wrap(angle: float) -> float:
    """The same direction between -pi and pi."""
    return math.atan2(math.sin(angle), math.cos(angle))


def relative(origin: Pose, pose: Pose) -> Pose:
    """A pose in the frame of another; the angle is between -pi and pi."""
    x, y = pose[0] - origin[0], pose[1] - origin[1]
    cos, sin = math.cos(origin[2]), math.sin(origin[2])
    return (cos * x + sin * y, cos * y - sin * x, wrap(pose[2] - origin[2]))


def compose(origin: Pose, pose: Pose) -> Pose:
    """A pose given in the frame `origin`, in the frame that this is given in."""
    cos, sin = math.cos(origin[2]), math.sin(origin[2])
    return (origin[0] + cos * pose[0] - sin * pose[1], origin[1] + sin * pose[0] + cos * pose[1], wrap(origin[2] + pose[2]))


def inverse(pose: Pose) -> Pose:
    """The frame that a pose is given in, seen from the pose."""
    return relative(pose, (0.0, 0.0, 0.0))


def between(one: Pose, other: Pose, share: float) -> Pose:
    """The pose at a share (0 to 1) of the way from one to another."""
    x, y = (one[i] + (other[i] - one[i]) * share for i in (0, 1))
    return (x, y, wrap(one[2] + wrap(other[2] - one[2]) * share))
