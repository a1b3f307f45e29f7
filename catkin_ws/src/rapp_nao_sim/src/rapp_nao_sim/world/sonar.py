"""The two sonars of the chest, by rays through the room."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from rapp_nao_sim.world import legs
from rapp_nao_sim.world.body import Body
from rapp_nao_sim.world.keys import ECHOES
from rapp_nao_sim.world.legs import Array
from rapp_nao_sim.world.model import Vector

FARTHEST = 5.0  # m: what a sonar gives without an echo
NEAREST = 0.01  # m
DETECTED = 0.5  # m: nearer things raise events
REACH = 2.55  # m
_DIGITS = 2  # of a reading in m
_APART = 0.05  # m between two echoes
_HALF = math.radians(30)  # of the cone
_GRAZING = 0.7  # cosine of the angle to a surface's normal beyond which the sound is thrown away from the robot
# Place (before the chest's shell) and direction, in the torso's frame.
_PLACES: dict[str, tuple[Vector, float, float]] = {
    "Left": ((0.06, 0.034, 0.0698), 0.044, 0.392),
    "Right": ((0.06, -0.034, 0.0698), 0.044, -0.392),
}


def _cone() -> Array:
    """Directions that fill a cone about x."""
    rays = [(1.0, 0.0, 0.0)]
    for ring in range(1, 5):
        off = _HALF * ring / 4
        for number in range(6 * ring):
            round_ = 2 * math.pi * number / (6 * ring)
            rays.append((math.cos(off), math.sin(off) * math.cos(round_), math.sin(off) * math.sin(round_)))
    return np.array(rays)


_CONE = _cone()


class Sonar:
    """Measures when told to; `echoes` holds the last distances (m) of each side, the nearest first."""

    def __init__(self, bullet: Any, body: Body) -> None:
        self._bullet = bullet
        self._body = body
        self.echoes: dict[str, tuple[float, ...]] = dict.fromkeys(_PLACES, (0.0,) * ECHOES)

    def measure(self) -> None:
        """Send both sonars' sound out."""
        position, rotation = self._body.torso()
        for side, (offset, pitch, yaw) in _PLACES.items():
            turned = rotation @ legs.turn((0.0, 0.0, 1.0), yaw) @ legs.turn((0.0, 1.0, 0.0), pitch)
            start = position + rotation @ np.array(offset)
            directions = _CONE @ turned.T
            ends = start + directions * REACH
            hits = self._bullet.rayTestBatch([start.tolist()] * len(ends), ends.tolist(), collisionFilterMask=Body.OTHERS)
            self.echoes[side] = heard(
                [
                    fraction * REACH
                    for (thing, _, fraction, _, normal), way in zip(hits, directions, strict=True)
                    if thing >= 0 and -float(way @ np.array(normal)) > _GRAZING
                ]
            )

    def near(self, side: str) -> float | None:
        """Distance of a near thing on a side, if there is one."""
        first = self.echoes[side][0]
        return first if 0 < first < DETECTED else None


def heard(distances: Sequence[float]) -> tuple[float, ...]:
    """The echoes told from each other, the nearest first."""
    found: list[float] = []
    for distance in sorted(distances):
        if not found or distance - found[-1] > _APART:
            found.append(distance)
    rounded = [max(NEAREST, round(distance, _DIGITS)) for distance in found[:ECHOES]]
    return (*rounded, *[FARTHEST] * (ECHOES - len(rounded)))
