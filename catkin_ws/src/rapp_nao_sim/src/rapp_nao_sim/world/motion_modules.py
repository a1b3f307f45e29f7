"""ALMotion and ALRobotPosture over the world, after NAOqi 2.1: joints, stiffness, postures.

Walking is not offered. What stops walking on a robot (stopMove, killMove) stops every movement here.
"""

import math
import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import qi

from rapp_nao_sim.naoqi import Module, NaoqiError, working
from rapp_nao_sim.world.arguments import joints, number, relative, spread, ways
from rapp_nao_sim.world.errors import WorldError
from rapp_nao_sim.world.model import JOINTS
from rapp_nao_sim.world.moves import Track, posture_time
from rapp_nao_sim.world.postures import FAMILIES, load

LONGEST = 60.0  # s, of one interpolation
RAMP = 0.05  # s between two stiffnesses of an interpolation


Ways = Sequence[Sequence[float]]  # for each joint, its values one after another


class World(Protocol):
    """What the modules need of WorldClient."""

    def robot_pose(self) -> tuple[float, float, float]: ...  # noqa: D102 - as WorldClient
    def velocity(self) -> tuple[float, float, float]: ...  # noqa: D102
    def joint_angles(self, names: Sequence[str]) -> list[float]: ...  # noqa: D102
    def commanded_angles(self, names: Sequence[str]) -> list[float]: ...  # noqa: D102
    def stiffnesses(self, names: Sequence[str]) -> list[float]: ...  # noqa: D102
    def set_stiffness(self, names: Sequence[str], values: Sequence[float]) -> None: ...  # noqa: D102
    def set_joints(self, names: Sequence[str], angles: Sequence[float], fraction: float) -> None: ...  # noqa: D102
    def move_joints(self, names: Sequence[str], angles: Ways, times: Ways) -> bool: ...  # noqa: D102
    def set_posture(self, name: str, speed: float) -> bool: ...  # noqa: D102
    def posture(self) -> tuple[str, str]: ...  # noqa: D102
    def wake_up(self) -> bool: ...  # noqa: D102
    def rest(self) -> bool: ...  # noqa: D102
    def awake(self) -> bool: ...  # noqa: D102
    def stop(self) -> None: ...  # noqa: D102
    def is_moving(self) -> bool: ...  # noqa: D102


def modules(world: World) -> dict[str, Any]:
    """The modules to register, by name."""
    return {"ALMotion": ALMotion(world), "ALRobotPosture": ALRobotPosture(world)}


def _asking(method: Callable[..., Any]) -> Callable[..., Any]:
    """A module's method that asks the world: off libqi's threads, the world's errors told as NAOqi's."""

    def call(self: Any, *args: Any) -> Any:
        try:
            return method(self, *args)
        except (WorldError, ValueError) as error:
            raise NaoqiError(str(error)) from error

    call.__name__ = method.__name__
    call.__doc__ = method.__doc__
    return working(call)


@qi.multiThreaded()
class ALMotion(Module):
    """Joints and stiffness. Angles in rad, hands from 0 closed to 1 open, times in s."""

    def __init__(self, world: World) -> None:
        self.__world = world
        self.__origin = world.robot_pose()  # NAOqi's world frame starts where the robot does

    @_asking
    def wakeUp(self) -> None:  # noqa: N802
        """Stiffen the joints; a robot on its feet stands up. Ends when it stands."""
        self.__world.wake_up()

    @_asking
    def rest(self) -> None:
        """Crouch and remove the stiffness; a sitting or lying robot stays as it is."""
        self.__world.rest()

    @_asking
    def robotIsWakeUp(self) -> bool:  # noqa: N802
        """Whether the robot is stiff."""
        return self.__world.awake()

    @_asking
    def stopMove(self) -> None:  # noqa: N802
        """End all movement at once."""
        self.__world.stop()

    @_asking
    def killMove(self) -> None:  # noqa: N802
        """As stopMove."""
        self.__world.stop()

    @_asking
    def killAll(self) -> None:  # noqa: N802
        """As stopMove."""
        self.__world.stop()

    @_asking
    def moveIsActive(self) -> bool:  # noqa: N802
        """Whether the robot moves by a command."""
        return self.__world.is_moving()

    @_asking
    def getBodyNames(self, name: str) -> list[str]:  # noqa: N802
        """The joints of a group."""
        return joints(name)

    @_asking
    def getLimits(self, names: str | list[str]) -> list[list[float]]:  # noqa: N802
        """For each joint: least and greatest angle, greatest speed (rad/s), greatest torque (Nm)."""
        limits = [JOINTS[name] for name in joints(names)]
        return [[limit.lower, limit.upper, limit.speed, limit.torque] for limit in limits]

    @_asking
    def getAngles(self, names: str | list[str], use_sensors: bool) -> list[float]:  # noqa: N802
        """What the sensors read, or where the motors are told to be."""
        found = joints(names)
        return self.__world.joint_angles(found) if use_sensors else self.__world.commanded_angles(found)

    @_asking
    def setAngles(self, names: str | list[str], angles: Any, fraction: float) -> None:  # noqa: N802
        """Send joints to angles at a fraction of their greatest speed; does not wait."""
        found = joints(names)
        self.__world.set_joints(found, spread(angles, len(found)), number(fraction))

    @_asking
    def changeAngles(self, names: str | list[str], changes: Any, fraction: float) -> None:  # noqa: N802
        """Change angles by amounts at a fraction of the joints' greatest speed; does not wait."""
        found = joints(names)
        now = self.__world.commanded_angles(found)
        goals = [angle + change for angle, change in zip(now, spread(changes, len(found)), strict=True)]
        self.__world.set_joints(found, goals, number(fraction))

    @_asking
    def angleInterpolation(self, names: str | list[str], angles: Any, times: Any, absolute: bool) -> None:  # noqa: N802
        """Send joints through angles at times, and wait; not absolute: angles added to those at the beginning."""
        found = joints(names)
        goals, when = ways(angles, len(found)), ways(times, len(found))
        if max(max(row) for row in when) > LONGEST:
            raise NaoqiError(f"cannot move for more than {LONGEST:g} s; divide the movement")
        if not absolute:
            begin = self.__world.commanded_angles(found)
            goals = [[start + value for value in row] for start, row in zip(begin, goals, strict=True)]
        self.__world.move_joints(found, goals, when)

    @_asking
    def angleInterpolationWithSpeed(self, names: str | list[str], angles: Any, fraction: float) -> None:  # noqa: N802
        """Send joints to angles, the slowest at a fraction of its greatest speed, all arriving together; and wait."""
        found, share = joints(names), number(fraction)
        if not 0 < share <= 1:
            raise NaoqiError("cannot move: the fraction of the greatest speed must be above 0 and at most 1")
        goals, now = spread(angles, len(found)), self.__world.commanded_angles(found)
        seconds = max(abs(goal - start) / JOINTS[name].speed for name, goal, start in zip(found, goals, now, strict=True))
        self.__world.move_joints(found, [[goal] for goal in goals], [[min(LONGEST, max(0.02, seconds / share))]] * len(found))

    @_asking
    def setStiffnesses(self, names: str | list[str], values: Any) -> None:  # noqa: N802
        """Set shares of the motors' torque, 0 to 1."""
        found = joints(names)
        self.__world.set_stiffness(found, spread(values, len(found)))

    @_asking
    def stiffnessInterpolation(self, names: str | list[str], values: Any, times: Any) -> None:  # noqa: N802
        """Bring the stiffness to the last of the values at the last of the times, and wait."""
        found = joints(names)
        goals, when = ways(values, len(found)), ways(times, len(found))
        longest = max(max(row) for row in when)
        if longest > LONGEST or min(min(row) for row in when) <= 0:
            raise NaoqiError(f"cannot take times beyond 0 to {LONGEST:g} s")
        begin = self.__world.stiffnesses(found)
        way = zip(begin, goals, when, strict=True)
        tracks = [Track(0.0, tuple(row), (start, *values), eased=False) for start, values, row in way]
        steps = max(1, math.ceil(longest / RAMP))
        for step in range(1, steps + 1):
            time.sleep(longest / steps)
            self.__world.set_stiffness(found, [track.at(longest * step / steps) for track in tracks])

    @_asking
    def getStiffnesses(self, names: str | list[str]) -> list[float]:  # noqa: N802
        """Shares of the motors' torque, 0 to 1."""
        return self.__world.stiffnesses(joints(names))

    @_asking
    def getRobotPosition(self, _use_sensors: bool) -> list[float]:  # noqa: N802
        """x and y (m) and theta (rad) in the frame that was the robot's when the simulator started."""
        return list(relative(self.__origin, self.__world.robot_pose()))

    @_asking
    def getRobotVelocity(self) -> list[float]:  # noqa: N802
        """Speed ahead and to the left (m/s), turning (rad/s)."""
        x, y, turning = self.__world.velocity()
        _, _, theta = self.__world.robot_pose()
        return [math.cos(theta) * x + math.sin(theta) * y, math.cos(theta) * y - math.sin(theta) * x, turning]


@qi.multiThreaded()
class ALRobotPosture(Module):
    """Predefined postures."""

    def __init__(self, world: World) -> None:
        self.__world = world
        self.__postures = load()

    @_asking
    def goToPosture(self, name: str, speed: float) -> bool:  # noqa: N802
        """Take a posture from any other, at a speed from 0 to 1; ends there, gives whether it is reached."""
        return self.__world.set_posture(name, number(speed))

    @_asking
    def applyPosture(self, name: str, speed: float) -> bool:  # noqa: N802
        """Bring the joints to a posture's angles, without care for balance; gives whether the robot is in it then."""
        if name not in self.__postures or not 0 < number(speed) <= 1:
            raise NaoqiError(
                f"cannot apply posture {name!r} at speed {speed}: known are {', '.join(self.__postures)}; speed to 1"
            )
        goal = dict(self.__postures[name].angles)
        found = list(goal)
        start = dict(zip(found, self.__world.joint_angles(found), strict=True))
        seconds = posture_time(start, goal, 0.0, number(speed))
        self.__world.move_joints(found, [[angle] for angle in goal.values()], [[seconds]] * len(found))
        return self.__world.posture()[0] == name

    @_asking
    def stopMove(self) -> None:  # noqa: N802
        """End all movement at once."""
        self.__world.stop()

    @_asking
    def getPosture(self) -> str:  # noqa: N802
        """The posture the robot is in, "Unknown" in between."""
        return self.__world.posture()[0]

    @_asking
    def getPostureFamily(self) -> str:  # noqa: N802
        """The family of the posture the robot is in."""
        return self.__world.posture()[1]

    @_asking
    def getPostureList(self) -> list[str]:  # noqa: N802
        """The predefined postures."""
        return list(self.__postures)

    @_asking
    def getPostureFamilyList(self) -> list[str]:  # noqa: N802
        """The families of postures."""
        return list(FAMILIES)
