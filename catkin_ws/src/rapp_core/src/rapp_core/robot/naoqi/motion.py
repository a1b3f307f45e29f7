"""Virtual effector e_body on ALMotion and ALRobotPosture."""

import contextlib
import threading
from collections.abc import Mapping, Sequence
from typing import Any

from rapp_core.body_ports import JointLimits, Movement, Pose2D
from rapp_core.errors import Invalid, Refused
from rapp_core.robot.naoqi.connection import Connection
from rapp_core.robot.naoqi.gaze import gaze
from rapp_core.robot.naoqi.movement import NaoqiMovement, Walking

FADE = 0.5  # s in which the motors are switched off
ROBOT_SPACE = 2
STANDING = "Standing"  # NAOqi's family of postures on straight or bent legs
FAMILIES = {"Sitting": "Sit", "LyingBelly": "LyingBelly", "LyingBack": "LyingBack"}
"""Of NAOqi's families those in which a robot can be without motors, and a posture of each."""
ARRIVED = 0.02  # rad between a joint and its goal
NAMES = (
    "a joint, a chain (Head, LArm, RArm, LLeg, RLeg), Torso, or a sensor (CameraTop, CameraBottom, MicroFront, Accelerometer, ...)"
)


class NaoqiMotion:
    """See `body_ports.Motion`. NAOqi's own frames are the port's: torso, world (odom), robot (base_link)."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._lock = threading.Lock()
        self._open: list[tuple[NaoqiMovement, tuple[str, ...]]] = []  # motions begun here, and their joints if not all
        self._resting: Movement | None = None  # the last release
        self._limits: dict[str, JointLimits] = {}

    def move_to(self, x: float, y: float, theta: float) -> Movement:
        """See `body_ports.Motion`."""
        return self._begin("ALMotion", "moveTo", x, y, theta)

    def move_velocity(self, x: float, y: float, theta: float) -> Movement:
        """See `body_ports.Motion`."""
        begun = self._connection.start("ALMotion", "move", x, y, theta)
        return Walking(self.moving, begun, self._stop_walk, lambda future: self._connection.result(future, "ALMotion", "move"))

    def move_joints(self, angles: Mapping[str, float], speed: float) -> Movement:
        """See `body_ports.Motion`."""
        joints = tuple(angles)
        self._connection.call("ALMotion", "setStiffnesses", list(joints), 1.0)
        goals = list(angles.values())
        begun = self._begin("ALMotion", "angleInterpolationWithSpeed", list(joints), goals, speed, joints=joints)
        begun.judge = lambda: self._arrived(joints, goals)
        return begun

    def _arrived(self, joints: Sequence[str], goals: Sequence[float]) -> bool:
        """Whether joints have been led to their goals: NAOqi does not tell a motion that was ended from one that has arrived."""
        led = self._connection.call("ALMotion", "getAngles", list(joints), False)
        return all(abs(angle - goal) <= ARRIVED for angle, goal in zip(led, goals, strict=True))

    def take_posture(self, name: str, speed: float) -> Movement:
        """See `body_ports.Motion`."""
        self._connection.call("ALMotion", "setStiffnesses", "Body", 1.0)
        return self._begin("ALRobotPosture", "goToPosture", name, speed)

    def look_at(self, x: float, y: float, z: float, speed: float) -> Movement:
        """See `body_ports.Motion`."""
        self._connection.call("ALMotion", "setStiffnesses", "Body", 1.0)  # a robot that stands up leans otherwise
        found = gaze(self.transform("Torso", ROBOT_SPACE), x, y, z)
        angles = dict(zip(("HeadYaw", "HeadPitch"), found or (), strict=False))
        limits = self.limits()
        if not angles or any(not limits[name].lower <= angle <= limits[name].upper for name, angle in angles.items()):
            raise Refused(f"cannot look at ({x:g}, {y:g}, {z:g}): the neck does not reach it; turn the robot or step back")
        return self.move_joints(angles, speed)

    def relax(self) -> Movement:
        """See `body_ports.Motion`."""
        return self._begin("ALMotion", "stiffnessInterpolation", "Body", 0.0, FADE)

    def release(self) -> Movement:
        """See `body_ports.Motion`."""
        self._resting = self._begin("ALMotion", "rest")
        return self._resting

    def stop(self) -> None:
        """See `body_ports.Motion`. All is asked for at once; joints that move by themselves are stopped by their names."""
        with self._lock:
            running = [(movement, joints) for movement, joints in self._open if not movement.done()]
            self._open = running
        for movement, _joints in running:
            movement.note_stop()
        start, answers = self._connection.start, []
        answers.append((start("ALMotion", "stopMove"), "ALMotion", "stopMove"))
        with contextlib.suppress(Refused):  # a robot without postures
            answers.append((start("ALRobotPosture", "stopMove"), "ALRobotPosture", "stopMove"))
        joints = sorted({name for _movement, names in running for name in names})
        if joints:
            answers.append((start("ALMotion", "killTasksUsingResources", joints), "ALMotion", "killTasksUsingResources"))
        for future, module, method in answers:
            self._connection.result(future, module, method)

    def moving(self) -> bool:
        """See `body_ports.Motion`."""
        return bool(self._connection.call("ALMotion", "moveIsActive"))

    def standing(self) -> bool:
        """See `body_ports.Motion`; a robot that is about to rest does not stand any more."""
        if self._resting is not None and not self._resting.done():
            return False
        family = self._connection.start("ALRobotPosture", "getPostureFamily")
        awake = bool(self._connection.call("ALMotion", "robotIsWakeUp"))
        return awake and self._connection.result(family, "ALRobotPosture", "getPostureFamily") == STANDING

    def postures(self) -> Sequence[str]:
        """See `body_ports.Motion`."""
        return [str(name) for name in self._connection.call("ALRobotPosture", "getPostureList")]

    def posture(self) -> str:
        """See `body_ports.Motion`."""
        return str(self._connection.call("ALRobotPosture", "getPosture"))

    def nearest_posture(self) -> str:
        """See `body_ports.Motion`."""
        name = self.posture()
        if name != "Unknown":
            return name
        return FAMILIES.get(str(self._connection.call("ALRobotPosture", "getPostureFamily")), name)

    def limits(self) -> Mapping[str, JointLimits]:
        """See `body_ports.Motion`; asked once: a robot keeps its joints."""
        if not self._limits:
            names = self._connection.call("ALMotion", "getBodyNames", "Body")
            rows = self._connection.call("ALMotion", "getLimits", "Body")
            self._limits = {
                str(name): JointLimits(float(row[0]), float(row[1]), float(row[2])) for name, row in zip(names, rows, strict=True)
            }
        return self._limits

    def angles(self, joints: Sequence[str]) -> tuple[float, ...]:
        """See `body_ports.Motion`."""
        return tuple(map(float, self._connection.call("ALMotion", "getAngles", list(joints), True)))

    def pose(self) -> Pose2D:
        """See `body_ports.Motion`."""
        x, y, theta = self._connection.call("ALMotion", "getRobotPosition", True)
        return Pose2D(float(x), float(y), float(theta))

    def transform(self, name: str, space: int) -> tuple[float, ...]:
        """See `body_ports.Motion`."""
        try:
            return tuple(map(float, self._connection.call("ALMotion", "getTransform", name, space, True)))
        except Refused as error:
            raise Invalid(f"cannot find {name!r} on this robot ({error}); give {NAMES}") from error

    def _begin(self, module: str, method: str, *args: Any, joints: tuple[str, ...] = ()) -> NaoqiMovement:
        future = self._connection.start(module, method, *args)
        movement = NaoqiMovement(self._connection, module, method, future, lambda: self._halt(module, joints))
        with self._lock:
            self._open = [entry for entry in self._open if not entry[0].done()] + [(movement, joints)]
        return movement

    def _halt(self, module: str, joints: tuple[str, ...]) -> None:
        if joints:
            self._connection.call("ALMotion", "killTasksUsingResources", list(joints))
        else:
            self._connection.call(module, "stopMove")

    def _stop_walk(self) -> None:
        self._connection.call("ALMotion", "stopMove")
