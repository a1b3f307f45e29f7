"""The NAO H25 V5 in tables: joints, links, masses, collision shapes; lengths in m, angles in rad, masses in kg, torques in Nm.

Figures of the joints, masses and inertias: the URDF naoV50 of ros-naoqi/nao_robot (BSD). The right side mirrors the left at
y = 0. The fingers are one link per hand, with a part of the hand's mass, turning by the hand's opening (0 closed, 1 open).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

Vector = tuple[float, float, float]

_S = math.sqrt(0.5)
SOLE: Vector = (0.0, 0.0, -0.04511)  # of the sole, in the ankle's frame


@dataclass(frozen=True)
class Joint:
    """A revolute joint at `offset` in the parent's frame."""

    parent: str
    child: str
    offset: Vector
    axis: Vector
    lower: float  # rad
    upper: float  # rad
    speed: float  # greatest, rad/s
    torque: float  # greatest, Nm


@dataclass(frozen=True)
class Link:
    """Mass, centre of mass in the link's frame, and diagonal inertia about it."""

    mass: float  # kg
    centre: Vector  # m
    inertia: Vector  # kg m²


@dataclass(frozen=True)
class Shape:
    """A collision box (edges), ball (radius) or rod along x (radius, length) in a link's frame."""

    kind: str
    size: tuple[float, ...]
    centre: Vector


_CENTRAL_JOINTS = {
    "HeadYaw": Joint("torso", "Neck", (0, 0, 0.1265), (0, 0, 1), -2.08567, 2.08567, 8.26797, 1.547),
    "HeadPitch": Joint("Neck", "Head", (0, 0, 0), (0, 1, 0), -0.671952, 0.514872, 7.19407, 1.532),
}
_LEFT_JOINTS = {
    "ShoulderPitch": Joint("torso", "Shoulder", (0, 0.098, 0.1), (0, 1, 0), -2.08567, 2.08567, 8.26797, 1.329),
    "ShoulderRoll": Joint("Shoulder", "Bicep", (0, 0, 0), (0, 0, 1), -0.314159, 1.32645, 7.19407, 1.7835),
    "ElbowYaw": Joint("Bicep", "Elbow", (0.105, 0.015, 0), (1, 0, 0), -2.08567, 2.08567, 8.26797, 1.547),
    "ElbowRoll": Joint("Elbow", "ForeArm", (0, 0, 0), (0, 0, 1), -1.54462, -0.0349066, 7.19407, 1.532),
    "WristYaw": Joint("ForeArm", "Wrist", (0.05595, 0, 0), (1, 0, 0), -1.82387, 1.82387, 24.6229, 0.4075),
    "Hand": Joint("Wrist", "Fingers", (0.058, 0, 0), (0, -1, 0), 0.0, 1.0, 8.33, 0.292),
    "HipYawPitch": Joint("torso", "Pelvis", (0, 0.05, -0.085), (0, _S, -_S), -1.14529, 0.740718, 4.16174, 3.348),
    "HipRoll": Joint("Pelvis", "Hip", (0, 0, 0), (1, 0, 0), -0.379435, 0.79046, 4.16174, 3.348),
    "HipPitch": Joint("Hip", "Thigh", (0, 0, 0), (0, 1, 0), -1.53589, 0.48398, 6.40239, 3.023),
    "KneePitch": Joint("Thigh", "Tibia", (0, 0, -0.1), (0, 1, 0), -0.0923279, 2.11255, 6.40239, 3.023),
    "AnklePitch": Joint("Tibia", "AnklePitch", (0, 0, -0.1029), (0, 1, 0), -1.18944, 0.922581, 6.40239, 3.023),
    "AnkleRoll": Joint("AnklePitch", "Ankle", (0, 0, 0), (1, 0, 0), -0.397761, 0.768992, 4.16174, 3.348),
}
_RIGHT_RANGES = {"RAnklePitch": (-1.1863, 0.932006)}  # where the right side is not the left one's mirror image
_MIRRORED = ("Roll",)  # the ranges that change sign on the right

_CENTRAL_LINKS = {
    "torso": Link(1.04956, (-0.00413, 0, 0.04342), (0.00308361, 0.0028835, 0.0015924)),
    "Neck": Link(0.07842, (-0.00001, 0, -0.02742), (1.6e-5, 1.7e-5, 5.5e-6)),
    "Head": Link(0.60533, (-0.00112, 0, 0.05258), (0.00095777, 0.00081684, 0.00098498)),
}
_LEFT_LINKS = {
    "Shoulder": Link(0.09304, (-0.00165, -0.02663, 0.00014), (1.83e-5, 1.39e-5, 2.02e-5)),
    "Bicep": Link(0.15777, (0.02455, 0.00563, 0.0033), (9.4e-5, 2.72e-4, 2.47e-4)),
    "Elbow": Link(0.06483, (-0.02744, 0, -0.00014), (5.6e-6, 2.66e-5, 2.76e-5)),
    "ForeArm": Link(0.07761, (0.02556, 0.00281, 0.00076), (2.47e-5, 3.84e-5, 3.6e-5)),
    "Wrist": Link(0.16533, (0.03134, -0.00088, 0.00308), (6.6e-5, 1.3e-4, 1.2e-4)),
    "Fingers": Link(0.02, (0.012, 0, 0), (3.0e-6, 4.0e-6, 5.0e-6)),
    "Pelvis": Link(0.06981, (-0.00781, -0.01114, 0.02661), (2.8e-5, 5e-5, 5.2e-5)),
    "Hip": Link(0.14053, (-0.01549, 0.00029, -0.00515), (2.4e-5, 6.1e-5, 5.4e-5)),
    "Thigh": Link(0.38968, (0.00138, 0.00221, -0.05373), (5.1e-4, 4.66e-4, 3.01e-4)),
    "Tibia": Link(0.30142, (0.00453, 0.00225, -0.04936), (4.46e-4, 3.88e-4, 1.85e-4)),
    "AnklePitch": Link(0.13416, (0.00045, 0.00029, 0.00685), (3.2e-5, 6.8e-5, 5.5e-5)),
    "Ankle": Link(0.17184, (0.02542, 0.0033, -0.03239), (8.7e-5, 3.5e-4, 4.1e-4)),
}

_CENTRAL_SHAPES = {
    "torso": [
        Shape("box", (0.11, 0.15, 0.19), (0, 0, 0.03)),
        Shape("box", (0.09, 0.11, 0.05), (-0.012, 0, -0.085)),  # pelvis: what the robot sits on
        Shape("box", (0.03, 0.10, 0.16), (-0.055, 0, 0.04)),
    ],
    "Head": [Shape("ball", (0.065,), (0, 0, 0.06))],
}
_LEFT_SHAPES = {
    "Bicep": [Shape("rod", (0.025, 0.09), (0.05, 0.008, 0))],
    "ForeArm": [Shape("rod", (0.022, 0.06), (0.035, 0, 0))],
    "Wrist": [Shape("box", (0.06, 0.045, 0.035), (0.045, 0, 0))],
    "Thigh": [Shape("box", (0.065, 0.06, 0.09), (0.005, 0.005, -0.045))],
    "Tibia": [Shape("box", (0.06, 0.055, 0.08), (0.005, 0.003, -0.05))],
    "Ankle": [Shape("box", (0.16, 0.09, 0.03), (0.025, 0.0035, -0.03011))],
}


def mirrored(vector: Vector) -> Vector:
    """The vector on the other side of the body's middle plane y = 0."""
    return (vector[0], -vector[1], vector[2])


def _sided(side: str, link: str) -> str:
    return link if link in _CENTRAL_LINKS else side + link


def _right_joint(name: str, joint: Joint) -> Joint:
    # A mirror turns the sense of rotations about x and z; NAO's axes stay, so its roll ranges change sign instead.
    lower, upper = (-joint.upper, -joint.lower) if name.endswith(_MIRRORED) else (joint.lower, joint.upper)
    lower, upper = _RIGHT_RANGES.get("R" + name, (lower, upper))
    axis = (0.0, _S, _S) if name == "HipYawPitch" else joint.axis
    return replace(joint, offset=mirrored(joint.offset), axis=axis, lower=lower, upper=upper)


def _joints() -> Iterator[tuple[str, Joint]]:
    yield from _CENTRAL_JOINTS.items()
    for side in "LR":
        for name, left in _LEFT_JOINTS.items():
            joint = left if side == "L" else _right_joint(name, left)
            yield side + name, replace(joint, parent=_sided(side, joint.parent), child=_sided(side, joint.child))


def _links() -> Iterator[tuple[str, Link]]:
    yield from _CENTRAL_LINKS.items()
    for name, link in _LEFT_LINKS.items():
        yield "L" + name, link
        yield "R" + name, replace(link, centre=mirrored(link.centre))


def _shapes() -> Iterator[tuple[str, list[Shape]]]:
    yield from _CENTRAL_SHAPES.items()
    for name, shapes in _LEFT_SHAPES.items():
        yield "L" + name, shapes
        yield "R" + name, [replace(shape, centre=mirrored(shape.centre)) for shape in shapes]


JOINTS: dict[str, Joint] = dict(_joints())
LINKS: dict[str, Link] = dict(_links())
SHAPES: dict[str, list[Shape]] = dict(_shapes())

_ARM = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw", "Hand")
_LEG = ("HipYawPitch", "HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
_HEAD = ["HeadYaw", "HeadPitch"]
_L_ARM, _R_ARM = (["L" + name for name in _ARM], ["R" + name for name in _ARM])
_L_LEG, _R_LEG = (["L" + name for name in _LEG], ["R" + name for name in _LEG])

# NAOqi's order of the joints in "Body" and its names of groups.
BODY: list[str] = [*_HEAD, *_L_ARM, *_L_LEG, *_R_LEG, *_R_ARM]
CHAINS: dict[str, list[str]] = {
    "Body": BODY,
    "Joints": BODY,
    "Head": _HEAD,
    "LArm": _L_ARM,
    "RArm": _R_ARM,
    "LLeg": _L_LEG,
    "RLeg": _R_LEG,
    "Arms": [*_L_ARM, *_R_ARM],
    "Legs": [*_L_LEG, *_R_LEG],
}
TWINS: dict[str, str] = {"LHipYawPitch": "RHipYawPitch", "RHipYawPitch": "LHipYawPitch"}  # one motor drives both
