"""Keeps arms out of torso, head and legs, and one leg out of the other: the body as balls and rods. Pure; m.

NAOqi's self-collision avoidance does the same for arms; a real robot's legs stop at each other.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rapp_nao_sim.world.frames import FRAMES, in_torso
from rapp_nao_sim.world.legs import SIDES, Array, Placement


class Rod(NamedTuple):
    """From one point of a frame to another, with a radius; a ball when both are one."""

    frame: str
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float


_TRUNK = [
    Rod("Torso", (0.0, 0.025, 0.09), (0.0, 0.025, -0.03), 0.05),
    Rod("Torso", (0.0, -0.025, 0.09), (0.0, -0.025, -0.03), 0.05),
    Rod("Torso", (-0.01, 0.0, -0.085), (-0.01, 0.0, -0.085), 0.045),
    Rod("Head", (0.0, 0.0, 0.06), (0.0, 0.0, 0.06), 0.065),
    *(Rod(f"{side}HipPitch", (0.0, 0.0, -0.02), (0.0, 0.0, -0.09), 0.03) for side in SIDES),
]
_DEEP = 0.002  # m that rods may overlap


_ARMS = {
    side: [
        Rod(f"{side}ElbowRoll", (0.0, 0.0, 0.0), (0.055, 0.0, 0.0), 0.02),
        Rod(f"{side}WristYaw", (0.02, 0.0, 0.0), (0.07, 0.0, 0.0), 0.02),
    ]
    for side in SIDES
}
# A foot is its two edges, and as narrow as the heel, so that Crouch, where heels are near each other, is free.
_LEGS = {
    side: [
        Rod(f"{side}KneePitch", (0.0, 0.0, -0.02), (0.0, 0.0, -0.08), 0.03),
        *(Rod(f"{side}AnkleRoll", (-0.02, y, -0.03), (0.07, y, -0.03), 0.015) for y in (middle - 0.022, middle + 0.022)),
    ]
    for side, middle in (("L", 0.0035), ("R", -0.0035))
}
# Each chain of joints that is held, its rods, and those that they must not come into.
_APART: dict[str, tuple[list[Rod], list[Rod]]] = {
    "LArm": (_ARMS["L"], [*_TRUNK, *_ARMS["R"]]),
    "RArm": (_ARMS["R"], [*_TRUNK, *_ARMS["L"]]),
    "Legs": (_LEGS["L"], _LEGS["R"]),
}
HELD = frozenset(_APART)


def depth(chain: str, angles: Mapping[str, float]) -> float:
    """How deep an arm is in the rest of the body, or one of the "Legs" in the other; below 0: how far it is from it."""
    places: dict[str, Placement] = {}

    def line(rod: Rod) -> tuple[Array, Array]:
        if rod.frame not in places:
            places[rod.frame] = in_torso(FRAMES[rod.frame], angles)
        rotation, position = places[rod.frame]
        return position + rotation @ rod.start, position + rotation @ rod.end

    mine, rest = ([(rod, *line(rod)) for rod in rods] for rods in _APART[chain])
    return max(one.radius + another.radius - _distance(a, b, c, d) for one, a, b in mine for another, c, d in rest)


def held(chain: str, before: Mapping[str, float], wanted: Mapping[str, float]) -> bool:
    """Whether a chain of HELD shall stay as it is, since it would come into the body on its way from `before` to `wanted`."""
    deep = depth(chain, wanted)
    return deep > _DEEP and deep > depth(chain, before)


def _distance(a: Array, b: Array, c: Array, d: Array) -> float:
    """Between two line segments (Ericson, Real-Time Collision Detection, 5.1.9)."""
    u, v, w = b - a, d - c, a - c
    uu, vv, uv, uw, vw = float(u @ u), float(v @ v), float(u @ v), float(u @ w), float(v @ w)
    spread = uu * vv - uv * uv
    s = min(1.0, max(0.0, (uv * vw - vv * uw) / spread)) if spread > 1e-12 else 0.0
    t = (uv * s + vw) / vv if vv > 1e-12 else 0.0
    if not 0 <= t <= 1 or vv <= 1e-12:
        t = min(1.0, max(0.0, t))
        s = min(1.0, max(0.0, (uv * t - uw) / uu)) if uu > 1e-12 else 0.0
    return float(np.linalg.norm(w + s * u - t * v))
