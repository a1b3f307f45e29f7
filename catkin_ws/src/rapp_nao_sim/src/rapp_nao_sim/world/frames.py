"""Where the parts of the body are, by its joints: names and frames of NAOqi's getPosition and getTransform. Pure; m and rad.

Figures of the sensors: the NAO V5's technical pages and the URDF naoV50 of ros-naoqi/nao_robot (BSD).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rapp_nao_sim.world import legs
from rapp_nao_sim.world.cameras import CAMERAS
from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.legs import Array, Placement
from rapp_nao_sim.world.model import JOINTS, LINKS, SOLE, Vector, mirrored
from rapp_nao_sim.world.poses import Pose

TORSO, WORLD, ROBOT = 0, 1, 2  # NAOqi's numbers of the frames
SPACES = {TORSO: "torso", WORLD: "world", ROBOT: "robot"}
HAND: Vector = (0.05775, 0.0, -0.01231)  # of the left one's middle, in the wrist's frame
_FSRS = {"FL": (0.0703, 0.0299), "FR": (0.0703, -0.0231), "RL": (-0.0303, 0.0299), "RR": (-0.0297, -0.0191)}  # left foot


@dataclass(frozen=True)
class Stance:
    """The body as a call needs it."""

    angles: Mapping[str, float]
    up: Vector  # the vertical in the torso's frame, as the inertial unit tells
    pose: Pose  # of the odometry


@dataclass(frozen=True)
class _Frame:
    """A frame fixed to a link, turned by yaw after pitch."""

    link: str
    offset: Vector = (0.0, 0.0, 0.0)
    pitch: float = 0.0
    yaw: float = 0.0


def _frames() -> dict[str, _Frame]:
    frames = {name: _Frame(joint.child) for name, joint in JOINTS.items()}
    frames |= {"Torso": _Frame("torso"), "Head": _Frame("Head")}
    frames |= {camera.name: _Frame("Head", camera.offset, camera.pitch) for camera in CAMERAS.values()}
    frames |= {"Accelerometer": _Frame("torso", (-0.008, 0.00606, 0.027)), "Gyrometer": _Frame("torso", (-0.008, 0.006, 0.029))}
    for side in legs.SIDES:
        place = (lambda at: at) if side == "L" else mirrored
        frames[f"{side}Arm"] = _Frame(f"{side}Wrist", place(HAND))
        frames[f"{side}Leg"] = _Frame(f"{side}Ankle", SOLE)
        for name, (x, y) in _FSRS.items():
            # The right foot mirrors the left one: its inner sensors are on the left.
            corner = name if side == "L" else name[0] + {"L": "R", "R": "L"}[name[1]]
            frames[f"{side}Fsr{corner}"] = _Frame(f"{side}Ankle", place((x, y, SOLE[2])))
    for number, sign in ((1, -1.0), (3, 1.0)):
        frames[f"USSensor{number}"] = _Frame("torso", (0.0537, 0.0341 * sign, 0.0698), -0.1745, 0.3490 * sign)
        frames[f"USSensor{number + 1}"] = _Frame("torso", (0.0477, 0.0416 * sign, 0.0509), 0.2618, 0.4363 * sign)
    return frames


FRAMES = _frames()
_PARENTS = {joint.child: name for name, joint in JOINTS.items()}


def transform(name: str, space: int, stance: Stance) -> Array:
    """A frame as 4x4 matrix in a space; raises Refused naming the known ones."""
    if name not in FRAMES:
        raise Refused(f"cannot find {name!r}: known are {', '.join(FRAMES)}")
    if space not in SPACES:
        raise Refused(f"cannot use frame {space!r}: known are {', '.join(f'{key} ({word})' for key, word in SPACES.items())}")
    place = in_torso(FRAMES[name], stance.angles)
    if space != TORSO:
        torso = _torso(stance)
        place = _after(torso, place)
    if space == WORLD:
        x, y, theta = stance.pose
        place = _after(Placement(legs.about_z(theta), np.array([x, y, 0.0])), place)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = place.rotation, place.position
    return matrix


def centre_of_mass(links: Sequence[str], space: int, stance: Stance) -> list[float]:
    """x, y, z in a space of the centre of mass of some of the links together; raises Refused for an unknown space."""
    torso = transform("Torso", space, stance)
    moment = np.zeros(3)
    for name in links:
        place = in_torso(_Frame(name), stance.angles)
        moment += LINKS[name].mass * (place.position + place.rotation @ np.array(LINKS[name].centre))
    middle = moment / sum(LINKS[name].mass for name in links)
    return [float(part) for part in torso[:3, :3] @ middle + torso[:3, 3]]


def six(matrix: Array) -> list[float]:
    """x, y, z, wx, wy, wz of a 4x4 matrix, its rotation being Rz(wz) Ry(wy) Rx(wx)."""
    wx, wz = math.atan2(matrix[2, 1], matrix[2, 2]), math.atan2(matrix[1, 0], matrix[0, 0])
    wy = math.asin(max(-1.0, min(1.0, -float(matrix[2, 0]))))
    return [*(float(part) for part in matrix[:3, 3]), wx, wy, wz]


def in_torso(frame: _Frame, angles: Mapping[str, float]) -> Placement:
    """Where a frame is, seen from the torso."""
    turned = legs.turn((0.0, 0.0, 1.0), frame.yaw) @ legs.turn((0.0, 1.0, 0.0), frame.pitch)
    place, link = Placement(turned, np.array(frame.offset, float)), frame.link
    while link in _PARENTS:
        joint = JOINTS[_PARENTS[link]]
        moved = Placement(legs.turn(joint.axis, angles[_PARENTS[link]]), np.array(joint.offset, float))
        place, link = _after(moved, place), joint.parent
    return place


def _torso(stance: Stance) -> Placement:
    """The torso in the robot's frame: on the floor between the soles, x where they point, z up."""
    soles = [legs.sole(side, stance.angles) for side in legs.SIDES]
    up = np.array(stance.up)
    ahead = sum((sole.rotation[:, 0] for sole in soles), np.zeros(3))
    ahead = ahead - up * (ahead @ up)
    if np.linalg.norm(ahead) < 0.6:  # toes up or down: it lies
        ahead = np.cross((0.0, 1.0, 0.0), up)
    ahead = ahead / np.linalg.norm(ahead)
    axes = np.vstack([ahead, np.cross(up, ahead), up])
    middle = (soles[0].position + soles[1].position) / 2
    lowest = min(float(sole.position @ up) for sole in soles)
    return Placement(axes, -(axes @ middle) + (0.0, 0.0, float(middle @ up) - lowest))


def gaze(point: Sequence[float], camera: str = "CameraTop") -> tuple[float, float]:
    """HeadYaw and HeadPitch that bring a point of the torso's frame onto a camera's axis; raises Refused for one in the head."""
    frame, neck = FRAMES[camera], JOINTS["HeadYaw"].offset
    x, y, z = (float(part) - offset for part, offset in zip(point, neck, strict=True))
    far, distance = math.hypot(x, y), math.hypot(x, y, z)
    # The point has the distance from the camera's axis that the neck has: none, once the camera is turned to it.
    beside = frame.offset[0] * math.sin(frame.pitch) + frame.offset[2] * math.cos(frame.pitch)
    if distance <= math.hypot(frame.offset[0], frame.offset[2]):
        raise Refused("cannot look at a point inside the head; give one farther away")
    return math.atan2(y, x), math.asin(beside / distance) - math.atan2(z, far) - frame.pitch


def _after(outer: Placement, inner: Placement) -> Placement:
    return Placement(outer.rotation @ inner.rotation, outer.position + outer.rotation @ inner.position)
