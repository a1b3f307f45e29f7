"""Poses on the ground: m, m, rad; a pose in a frame is also the way from that frame's origin."""

import math

from rapp_core.body_ports import Pose2D


def compose(frame: Pose2D, pose: Pose2D) -> Pose2D:
    """A pose given in `frame`, in the frame in which `frame` is given."""
    cos, sin = math.cos(frame.theta), math.sin(frame.theta)
    x, y = frame.x + cos * pose.x - sin * pose.y, frame.y + sin * pose.x + cos * pose.y
    return Pose2D(x, y, turned(frame.theta + pose.theta))


def inverse(pose: Pose2D) -> Pose2D:
    """The frame's origin as seen from a pose in it."""
    cos, sin = math.cos(pose.theta), math.sin(pose.theta)
    return Pose2D(-cos * pose.x - sin * pose.y, sin * pose.x - cos * pose.y, turned(-pose.theta))


def relative(frame: Pose2D, pose: Pose2D) -> Pose2D:
    """A pose as seen from `frame`, both given in one frame."""
    return compose(inverse(frame), pose)


def turned(theta: float) -> float:
    """The same direction as an angle from -pi to pi."""
    return math.remainder(theta, math.tau)


def finite(*values: float) -> bool:
    """Whether all are numbers, and none is infinite."""
    return all(map(math.isfinite, values))
