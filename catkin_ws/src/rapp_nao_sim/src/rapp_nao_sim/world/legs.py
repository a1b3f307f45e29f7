"""Kinematics of the legs: where the soles are for given joints, and which joints bring them there; m and rad, in the torso's frame.

One motor drives the HipYawPitch of both legs, so that both soles are placed by 11 angles, as well as these can.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rapp_nao_sim.world.model import CHAINS, JOINTS, LINKS, SOLE

Array = npt.NDArray[np.float64]

SIDES = "LR"
_LEGS = {side: CHAINS[f"{side}Leg"] for side in SIDES}
_FREE = ["LHipYawPitch", *_LEGS["L"][1:], *_LEGS["R"][1:]]
_OFFSETS = {name: np.array(joint.offset, float) for name, joint in JOINTS.items()}
_SOLE = np.array(SOLE)
_LOWER = np.array([JOINTS[name].lower for name in _FREE])
_UPPER = np.array([JOINTS[name].upper for name in _FREE])
_TWIST = 0.1  # m for which an error of 1 rad counts
_DAMPING = 1e-6
_EXACT = 1e-5  # m; rad a tenth as well


class Placement(NamedTuple):
    """Orientation (3x3) and position of a frame."""

    rotation: Array
    position: Array


def turn(axis: tuple[float, float, float], angle: float) -> Array:
    """Rotation matrix about an axis of length 1."""
    x, y, z = axis
    cos, sin = math.cos(angle), math.sin(angle)
    rest = 1 - cos
    return np.array(
        [
            [x * x * rest + cos, x * y * rest - z * sin, x * z * rest + y * sin],
            [x * y * rest + z * sin, y * y * rest + cos, y * z * rest - x * sin],
            [x * z * rest - y * sin, y * z * rest + x * sin, z * z * rest + cos],
        ]
    )


def about_z(angle: float) -> Array:
    """Rotation matrix about the vertical."""
    return turn((0.0, 0.0, 1.0), angle)


def sole(side: str, angles: Mapping[str, float]) -> Placement:
    """Where a sole is."""
    rotation, position, _, _ = _leg(side, angles)
    return Placement(rotation, position)


def centre_of_mass(angles: Mapping[str, float]) -> Array:
    """Of the whole body."""
    places = {"torso": Placement(np.eye(3), np.zeros(3))}
    torso = LINKS["torso"]
    mass, moment = torso.mass, torso.mass * np.array(torso.centre)
    for name, joint in JOINTS.items():
        parent = places[joint.parent]
        position = parent.position + parent.rotation @ _OFFSETS[name]
        rotation = parent.rotation @ turn(joint.axis, angles[name])
        places[joint.child] = Placement(rotation, position)
        link = LINKS[joint.child]
        mass += link.mass
        moment = moment + link.mass * (position + rotation @ np.array(link.centre))
    centre: Array = moment / mass
    return centre


def reach(start: Mapping[str, float], left: Placement, right: Placement, rounds: int = 3) -> dict[str, float]:
    """The legs' angles, near `start`, that bring the soles to two places as well as they can (damped least squares)."""
    angles = {name: start[name] for side in SIDES for name in _LEGS[side]}
    values = np.array([angles[name] for name in _FREE])
    for _ in range(rounds):
        error, jacobian = np.empty(12), np.zeros((12, 11))
        for row, side, goal in ((0, "L", left), (6, "R", right)):
            rotation, position, axes, points = _leg(side, angles)
            error[row : row + 3] = goal.position - position
            error[row + 3 : row + 6] = _TWIST * _rotation_vector(goal.rotation @ rotation.T)
            arms = position - points
            columns = np.vstack([_cross(axes, arms).T, _TWIST * axes.T])
            jacobian[row : row + 6, 0] = columns[:, 0]
            jacobian[row : row + 6, 1 + 5 * (row // 6) : 6 + 5 * (row // 6)] = columns[:, 1:]
        if np.abs(error).max() < _EXACT:
            break
        normal = jacobian.T @ jacobian
        normal.flat[::12] += _DAMPING
        values = np.clip(values + np.linalg.solve(normal, jacobian.T @ error), _LOWER, _UPPER)
        angles.update(zip(_FREE, values.tolist(), strict=True))
        angles["RHipYawPitch"] = angles["LHipYawPitch"]
    return angles


def _leg(side: str, angles: Mapping[str, float]) -> tuple[Array, Array, Array, Array]:
    """Orientation and position of the sole; axis and origin of each joint."""
    rotation, position = np.eye(3), np.zeros(3)
    axes, points = np.empty((6, 3)), np.empty((6, 3))
    for number, name in enumerate(_LEGS[side]):
        axis = JOINTS[name].axis
        position = position + rotation @ _OFFSETS[name]
        axes[number], points[number] = rotation @ axis, position
        rotation = rotation @ turn(axis, angles[name])
    return rotation, position + rotation @ _SOLE, axes, points


def _cross(one: Array, other: Array) -> Array:
    """Cross products row by row; np.cross is ten times slower for so few."""
    product: Array = one[:, [1, 2, 0]] * other[:, [2, 0, 1]] - one[:, [2, 0, 1]] * other[:, [1, 2, 0]]
    return product


def _rotation_vector(rotation: Array) -> Array:
    """Axis times angle of a rotation below half a turn."""
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    angle = math.acos(max(-1.0, min(1.0, (rotation.trace() - 1) / 2)))
    return axis * (0.5 if angle < 1e-6 else angle / (2 * math.sin(angle)))
