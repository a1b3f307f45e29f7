"""ALMotion over the world, after NAOqi 2.1: joints, stiffness; walking and frames are in modules of their own."""

import math
import time
from typing import Any

import qi

from rapp_nao_sim.naoqi import NaoqiError
from rapp_nao_sim.world.arguments import joints, number, spread, ways
from rapp_nao_sim.world.asking import World, asking
from rapp_nao_sim.world.model import BODY, JOINTS
from rapp_nao_sim.world.moves import Track
from rapp_nao_sim.world.posture_module import ALRobotPosture
from rapp_nao_sim.world.reflex_module import Reflexes
from rapp_nao_sim.world.tracker_module import ALTracker
from rapp_nao_sim.world.walk_module import Walking

LONGEST = 60.0  # s, of one interpolation
HAND_TIME = 0.8  # s to open or close a hand
PRIORITY = 90  # of every task, as told
RAMP = 0.05  # s between two stiffnesses of an interpolation


def modules(world: World) -> dict[str, Any]:
    """The modules to register, by name."""
    return {"ALMotion": ALMotion(world), "ALRobotPosture": ALRobotPosture(world), "ALTracker": ALTracker(world)}


@qi.multiThreaded()
class ALMotion(Walking, Reflexes):
    """Joints and stiffness. Angles in rad, hands from 0 closed to 1 open, times in s."""

    def __init__(self, world: World) -> None:
        Walking.__init__(self, world)
        Reflexes.__init__(self, world)
        self.__world = world

    @asking
    def wakeUp(self) -> None:  # noqa: N802
        """Stiffen the joints; a robot on its feet stands up. Ends when it stands."""
        self.__world.wake_up()

    @asking
    def rest(self) -> None:
        """Crouch and remove the stiffness; a sitting or lying robot stays as it is."""
        self.__world.rest()

    @asking
    def robotIsWakeUp(self) -> bool:  # noqa: N802
        """Whether the robot is stiff."""
        return self.__world.awake()

    @asking
    def killAll(self) -> None:  # noqa: N802
        """End all movement at once."""
        self.__world.stop()

    @asking
    def killTasksUsingResources(self, names: str | list[str]) -> None:  # noqa: N802
        """End the movement of joints at once."""
        self.__world.stop_joints(joints(names))

    @asking
    def getTaskList(self) -> list[list[Any]]:  # noqa: N802
        """What moves the robot now: for each task its name, number, broker, priority and joints."""
        return [[name, number, self.getBrokerName(), PRIORITY, found] for name, number, found in self.__world.tasks()]

    @asking
    def killTask(self, number: int) -> bool:  # noqa: N802
        """End one task of getTaskList at once; gives whether there is such a one."""
        task = next((task for task in self.__world.tasks() if task[1] == number), None)
        if task is not None:
            ends = {"goToPosture": self.__world.stop_posture, "move": self.__world.stop_walk}
            ends.get(task[0], lambda: self.__world.stop_joints(task[2]))()
        return task is not None

    @asking
    def getSummary(self) -> str:  # noqa: N802
        """A table of stiffness, command and sensor of each joint, and one of the tasks, as a text."""
        values = (self.__world.stiffnesses(BODY), self.__world.commanded_angles(BODY), self.__world.joint_angles(BODY))
        rows = [
            f"{name:>16} {held:>11.6f} {told:>11.6f} {felt:>11.6f}" for name, held, told, felt in zip(BODY, *values, strict=True)
        ]
        tasks = [f"{name:>20} {number:>10}" for name, number, _ in self.__world.tasks()]
        head = [f"{'Model':-^52}", f"{'JointName':>16} {'Stiffness':>11} {'Command':>11} {'Sensor':>11}"]
        return "\n".join([*head, *rows, f"{'Tasks':-^52}", f"{'Name':>20} {'ID':>10}", *tasks])

    @asking
    def areResourcesAvailable(self, names: str | list[str]) -> bool:  # noqa: N802
        """Whether no command uses joints."""
        return not self.__world.busy(joints(names))

    @asking
    def getBodyNames(self, name: str) -> list[str]:  # noqa: N802
        """The joints of a group."""
        return joints(name)

    @asking
    def getLimits(self, names: str | list[str]) -> list[list[float]]:  # noqa: N802
        """For each joint: least and greatest angle, greatest speed (rad/s), greatest torque (Nm)."""
        limits = [JOINTS[name] for name in joints(names)]
        return [[limit.lower, limit.upper, limit.speed, limit.torque] for limit in limits]

    @asking
    def getAngles(self, names: str | list[str], use_sensors: bool) -> list[float]:  # noqa: N802
        """What the sensors read, or where the motors are told to be."""
        found = joints(names)
        return self.__world.joint_angles(found) if use_sensors else self.__world.commanded_angles(found)

    @asking
    def setAngles(self, names: str | list[str], angles: Any, fraction: float) -> None:  # noqa: N802
        """Send joints to angles at a fraction of their greatest speed; does not wait."""
        found = joints(names)
        self.__world.set_joints(found, spread(angles, len(found)), number(fraction))

    @asking
    def changeAngles(self, names: str | list[str], changes: Any, fraction: float) -> None:  # noqa: N802
        """Change angles by amounts at a fraction of the joints' greatest speed; does not wait."""
        found = joints(names)
        now = self.__world.commanded_angles(found)
        goals = [angle + change for angle, change in zip(now, spread(changes, len(found)), strict=True)]
        self.__world.set_joints(found, goals, number(fraction))

    @asking
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

    @asking
    def angleInterpolationWithSpeed(self, names: str | list[str], angles: Any, fraction: float) -> None:  # noqa: N802
        """Send joints to angles, the slowest at a fraction of its greatest speed, all arriving together; and wait."""
        found, share = joints(names), number(fraction)
        if not 0 < share <= 1:
            raise NaoqiError("cannot move: the fraction of the greatest speed must be above 0 and at most 1")
        goals, now = spread(angles, len(found)), self.__world.commanded_angles(found)
        seconds = max(abs(goal - start) / JOINTS[name].speed for name, goal, start in zip(found, goals, now, strict=True))
        self.__world.move_joints(found, [[goal] for goal in goals], [[min(LONGEST, max(0.02, seconds / share))]] * len(found))

    @asking
    def openHand(self, name: str) -> None:  # noqa: N802
        """Open LHand or RHand, and wait."""
        self.__world.move_joints(_hand(name), [[1.0]], [[HAND_TIME]])

    @asking
    def closeHand(self, name: str) -> None:  # noqa: N802
        """Close LHand or RHand, and wait."""
        self.__world.move_joints(_hand(name), [[0.0]], [[HAND_TIME]])

    @asking
    def setStiffnesses(self, names: str | list[str], values: Any) -> None:  # noqa: N802
        """Set shares of the motors' torque, 0 to 1."""
        found = joints(names)
        self.__world.set_stiffness(found, spread(values, len(found)))

    @asking
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

    @asking
    def getStiffnesses(self, names: str | list[str]) -> list[float]:  # noqa: N802
        """Shares of the motors' torque, 0 to 1."""
        return self.__world.stiffnesses(joints(names))


def _hand(name: str) -> list[str]:
    if name not in ("LHand", "RHand"):
        raise NaoqiError(f"cannot find hand {name!r}: known are LHand, RHand")
    return [name]
