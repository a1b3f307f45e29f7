"""Where the robot is, from the codes on the walls: their corners in pictures, whose camera's pose in the robot is known."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rapp_api import Pose

Array = NDArray[np.float64]

FIELD_OF_VIEW = math.radians(60.97)  # of a NAO's cameras, from left to right
ROUNDS = 40
STILL = 1e-7
PRECISE = 4.0  # pixels of a VGA picture that a corner is off on average at most, where the pose is right
SPREAD = (-1.0, -0.5, 0.0, 0.5, 1.0)  # rad beside the code's own direction from which it may be looked at, to begin with


@dataclass(frozen=True)
class Code:
    """A code on a wall: its middle in the map, the direction it faces, and its side's length; m, rad."""

    centre: tuple[float, float, float]
    facing: float
    side: float

    def corners(self) -> Array:
        """Top left, top right, bottom right, bottom left, as one reads it."""
        right = np.array([-math.sin(self.facing), math.cos(self.facing), 0.0]) * self.side / 2
        up = np.array([0.0, 0.0, self.side / 2])
        return np.array([self.centre + up - right, self.centre + up + right, self.centre - up + right, self.centre - up - right])


@dataclass(frozen=True)
class Sight:
    """A code that was seen: its corners in the map, where each was in the picture (focal lengths from its middle), the camera."""

    corners: Array
    seen: Array
    camera: Array  # 4x4 in the robot: x ahead, y to the left, z up
    focal: float  # pixels of a picture that is 640 wide


def codes_of(parameters: Mapping[str, Any]) -> dict[str, Code]:
    """The codes of package.json, by their texts."""
    return {text: Code(tuple(item["centre"]), item["facing"], item["side"]) for text, item in parameters.items()}


def sight(code: Code, pixels: Sequence[Sequence[float]], size: tuple[int, int], camera: Array) -> Sight:
    """A code in a picture of a size (width, height)."""
    width, height = size
    focal = width / 2 / math.tan(FIELD_OF_VIEW / 2)
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    return Sight(code.corners(), (np.array(pixels, np.float64) - middle) / focal, camera, focal * 640 / width)


def locate(sights: Sequence[Sight]) -> Pose | None:
    """The pose in the map that explains best what was seen, by least squares; None when none does."""
    best, least = None, math.inf
    for start in _starts(sights[0]) if sights else ():
        pose, off = _improved(np.array(start), sights)
        if off < least:
            best, least = pose, off
    if best is None or least > PRECISE:
        return None
    return Pose(float(best[0]), float(best[1]), math.remainder(float(best[2]), math.tau))


def _starts(first: Sight) -> list[tuple[float, float, float]]:
    """Poses from which the first code would be seen about as large and where it was."""
    side = np.linalg.norm(np.diff(first.corners, axis=0), axis=1).mean()
    height = np.abs(first.seen[[0, 1], 1] - first.seen[[3, 2], 1]).mean()
    away = side / max(float(height), 1e-3)
    right = first.corners[1] - first.corners[0]
    facing = math.atan2(-right[0], right[1])
    ahead = first.camera[:3, 0] - first.seen[:, 0].mean() * first.camera[:3, 1]
    bearing = math.atan2(ahead[1], ahead[0])
    x, y, _ = first.corners.mean(axis=0)
    places = [(x + away * math.cos(facing + side), y + away * math.sin(facing + side), facing + side) for side in SPREAD]
    return [(px, py, turn + math.pi - bearing) for px, py, turn in places]


def _improved(pose: Array, sights: Sequence[Sight]) -> tuple[Array, float]:
    """Levenberg-Marquardt on x, y, theta; gives the pose and how far corners are off, in pixels of a VGA picture."""
    damping, off = 1e-3, _residuals(pose, sights)
    for _ in range(ROUNDS):
        steps = np.eye(3) * 1e-5
        slope = np.column_stack([(_residuals(pose + step, sights) - off) / 1e-5 for step in steps])
        square = slope.T @ slope
        change = np.linalg.solve(square + damping * np.diag(np.diag(square) + 1e-9), -slope.T @ off)
        tried = _residuals(pose + change, sights)
        if tried @ tried < off @ off:
            pose, off, damping = pose + change, tried, damping / 3
            if np.abs(change).max() < STILL:
                break
        else:
            damping *= 4
    return pose, float(np.sqrt((off**2).mean()))


def _residuals(pose: Array, sights: Sequence[Sight]) -> Array:
    """Pixels that each corner is beside where it would be seen from a pose."""
    parts = []
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    for item in sights:
        in_robot = (item.corners - [pose[0], pose[1], 0.0]) @ turn.T
        ahead, left, up = ((in_robot - item.camera[:3, 3]) @ item.camera[:3, :3]).T
        ahead = np.maximum(ahead, 0.05)
        parts += [(-left / ahead - item.seen[:, 0]) * item.focal, (-up / ahead - item.seen[:, 1]) * item.focal]
    return np.concatenate(parts)
