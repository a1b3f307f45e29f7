"""The NAO in a pybullet world: its joints, motors and pose."""

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.model import BODY, JOINTS, LINKS, SHAPES, SOLE
from rapp_nao_sim.world.urdf import urdf, write_meshes

Array = npt.NDArray[np.float64]
Quaternion = tuple[float, float, float, float]

_GAIN = 0.3  # of pybullet's position motors; .1 to .6 stand alike
_GEARS = 0.15  # share of its torque that the friction of a joint's gears holds without stiffness
_REST = 0.002  # m/s
_CLEARANCE = 0.0005  # m above the floor when the body is put down
_GROUP = 64  # of pybullet's collision filter: the robot's own
_GRAVITY = 9.81  # m/s²


class Body:
    """The robot; joints are named as NAOqi does, angles are in rad, the world's frame in m."""

    OTHERS = 0x7FFFFFFF & ~_GROUP  # mask of rays that pass through the robot

    def __init__(self, bullet: Any, looks: bool, own_view: bool = False) -> None:
        self._bullet = bullet
        with tempfile.TemporaryDirectory(prefix="rapp-nao-") as folder:
            path = Path(folder) / "nao.urdf"
            path.write_text(urdf(write_meshes(Path(folder), own_view) if looks else None))
            self._robot: int = bullet.loadURDF(str(path), (0, 0, 1))
        infos = [bullet.getJointInfo(self._robot, number) for number in range(bullet.getNumJoints(self._robot))]
        self._number = {info[1].decode(): int(info[0]) for info in infos}
        self._numbers = [self._number[name] for name in BODY]
        links = {info[12].decode(): int(info[0]) for info in infos}
        self._links = links
        self._solid = [links.get(name, -1) for name in SHAPES]
        self._feet = [links["LAnkle"], links["RAnkle"]]
        for link in self._solid:
            # Anchored, or the robot creeps round by a degree every few seconds.
            bullet.changeDynamics(self._robot, link, lateralFriction=0.9, frictionAnchor=1)
            bullet.setCollisionFilterGroupMask(self._robot, link, _GROUP, -1)
        self._speed = (0.0, 0.0, 0.0)  # of the torso before the last step
        self._pull = (0.0, 0.0, -_GRAVITY)

    def angles(self) -> dict[str, float]:
        """What the joints' sensors read."""
        states = self._bullet.getJointStates(self._robot, self._numbers)
        return {name: float(state[0]) for name, state in zip(BODY, states, strict=True)}

    def drive(self, targets: Mapping[str, float], stiffness: Mapping[str, float]) -> None:
        """Let the motors hold these angles with these stiffnesses (0 to 1) until told otherwise."""
        bullet = self._bullet
        for name, number in self._number.items():
            bullet.setJointMotorControl2(
                self._robot,
                number,
                bullet.POSITION_CONTROL,
                targetPosition=targets[name],
                force=JOINTS[name].torque * max(_GEARS, stiffness[name]),
                positionGain=_GAIN,
                velocityGain=1.0,
            )

    def put(self, angles: Mapping[str, float], orientation: Quaternion, feet: tuple[float, float]) -> None:
        """Set the whole body at rest in a shape, with the middle of its soles above `feet` and its lowest part on the floor."""
        bullet = self._bullet
        for name, number in self._number.items():
            bullet.resetJointState(self._robot, number, angles[name])
        bullet.resetBasePositionAndOrientation(self._robot, (0, 0, 1), orientation)
        x, y = self.feet()
        lowest = min(bullet.getAABB(self._robot, link)[0][2] for link in self._solid)
        position = (feet[0] - x, feet[1] - y, 1 - lowest + _CLEARANCE)
        bullet.resetBasePositionAndOrientation(self._robot, position, orientation)
        bullet.resetBaseVelocity(self._robot, (0, 0, 0), (0, 0, 0))

    def mirror(self, angles: Mapping[str, float], position: tuple[float, float, float], orientation: Quaternion) -> None:
        """Take the state that `angles` and `base` of another Body gave."""
        for name, number in self._number.items():
            self._bullet.resetJointState(self._robot, number, angles[name])
        self._bullet.resetBasePositionAndOrientation(self._robot, position, orientation)

    def base(self) -> tuple[tuple[float, float, float], Quaternion]:
        """Position of the torso's centre of mass and orientation of the torso."""
        position, orientation = self._bullet.getBasePositionAndOrientation(self._robot)
        return position, orientation

    def frame(self, link: str) -> tuple[tuple[float, float, float], Quaternion]:
        """Origin and orientation of a link's frame (not of its centre of mass)."""
        state = self._bullet.getLinkState(self._robot, self._links[link], computeForwardKinematics=1)
        return state[4], state[5]

    def torso(self) -> tuple[Array, Array]:
        """Origin and rotation matrix of the torso's frame."""
        position, orientation = self.base()
        rotation = np.array(self._bullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        return np.array(position) - rotation @ np.array(LINKS["torso"].centre), rotation

    def matrix(self, link: str) -> list[float]:
        """A link's frame, or the torso's, as 4x4 matrix row by row; raises Refused naming the known ones."""
        matrix = np.eye(4)
        if link == "torso":
            matrix[:3, 3], matrix[:3, :3] = self.torso()
        elif link in self._links:
            matrix[:3, 3], orientation = self.frame(link)
            matrix[:3, :3] = np.array(self._bullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        else:
            raise Refused(f"cannot find link {link!r}: known are torso, {', '.join(self._links)}")
        return [float(value) for value in matrix.flat]

    def contacts(self, link: str) -> Any:
        """pybullet's contact points between a link and the room."""
        return self._bullet.getContactPoints(bodyA=self._robot, linkIndexA=self._links[link])

    def loads(self) -> dict[str, float]:
        """The motors' torques, Nm."""
        states = self._bullet.getJointStates(self._robot, self._numbers)
        return {name: float(state[3]) for name, state in zip(BODY, states, strict=True)}

    def sense(self, seconds: float) -> None:
        """What the accelerometer needs, after steps of the physics that took so long: m/s² of gravity less acceleration."""
        (x, y, z), _ = self._bullet.getBaseVelocity(self._robot)
        gained = [(new - old) / seconds for new, old in zip((x, y, z), self._speed, strict=True)]
        self._speed, self._pull = (x, y, z), (-gained[0], -gained[1], -_GRAVITY - gained[2])

    def inertia(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Of the torso, along its own axes: turning in rad/s, and the pull that the accelerometer shows in m/s²."""
        _, rotation = self.torso()
        _, turning = self._bullet.getBaseVelocity(self._robot)
        return tuple((rotation.T @ turning).tolist()), tuple((rotation.T @ self._pull).tolist())

    def tilt(self) -> float:
        """Of the torso from upright."""
        return math.acos(max(-1.0, min(1.0, self.up()[2])))

    def pressed(self) -> set[int]:
        """Bodies that the robot's presses against, itself among them."""
        return {point[2] for point in self._bullet.getContactPoints(bodyA=self._robot) if point[9] > 0}

    def touches(self, other: int) -> bool:
        """Whether the robot touches or overlaps another body."""
        return bool(self._bullet.getClosestPoints(self._robot, other, 0.0))

    def velocity(self) -> tuple[float, float, float]:
        """Ahead, to the left (m/s) and turning (rad/s) of the torso on the floor."""
        (x, y, _), (_, _, turning) = self._bullet.getBaseVelocity(self._robot)
        cos, sin = math.cos(self.heading()), math.sin(self.heading())
        return (cos * x + sin * y, cos * y - sin * x, float(turning))

    def still(self) -> bool:
        """Whether the torso rests, as good as the solver's noise lets one see."""
        linear, angular = self._bullet.getBaseVelocity(self._robot)
        return math.hypot(*linear) < _REST and math.hypot(*angular) < 5 * _REST

    def feet(self) -> tuple[float, float]:
        """Middle of the soles."""
        soles = []
        for foot in self._feet:
            state = self._bullet.getLinkState(self._robot, foot, computeForwardKinematics=1)
            soles.append(self._bullet.multiplyTransforms(state[4], state[5], SOLE, (0, 0, 0, 1))[0])
        left, right = soles
        return ((left[0] + right[0]) / 2, (left[1] + right[1]) / 2)

    def pose(self) -> tuple[float, float, float]:
        """x and y of the middle of the soles, and the heading, which is meant also for a lying robot."""
        return (*self.feet(), self.heading())

    def heading(self) -> float:
        """Direction on the floor in which the robot, were it turned upright about its own left-right axis, would look."""
        forward, _, up = self._axes()
        x, y = (up[2] * forward[i] - forward[2] * up[i] for i in (0, 1))
        if math.hypot(x, y) < 0.1:  # on its side
            x, y = forward[0], forward[1]
        return math.atan2(y, x)

    def lean(self) -> tuple[float, float]:
        """Pitch (forward positive) and roll (to the right positive) of the torso."""
        forward, left, up = self._axes()
        return math.atan2(-forward[2], up[2]) if abs(left[2]) < 0.9 else 0.0, math.asin(max(-1.0, min(1.0, left[2])))

    def up(self) -> tuple[float, float, float]:
        """The vertical in the torso's frame."""
        forward, left, up = self._axes()
        return (float(forward[2]), float(left[2]), float(up[2]))

    def hips(self) -> float:
        """Height of the hips above the floor, m."""
        state = self._bullet.getLinkState(self._robot, self._number["LHipYawPitch"], computeForwardKinematics=1)
        return float(state[4][2])

    def push(self, force: tuple[float, float, float]) -> None:
        """A force in N on the torso, for the next step."""
        position, _ = self.base()
        self._bullet.applyExternalForce(self._robot, -1, force, position, self._bullet.WORLD_FRAME)

    def _axes(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        matrix = self._bullet.getMatrixFromQuaternion(self.base()[1])
        return (matrix[0::3], matrix[1::3], matrix[2::3])
