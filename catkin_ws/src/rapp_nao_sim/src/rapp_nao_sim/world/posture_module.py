"""ALRobotPosture over the world, after NAOqi 2.1."""

import qi

from rapp_nao_sim.naoqi import Module, NaoqiError
from rapp_nao_sim.world.arguments import number
from rapp_nao_sim.world.asking import World, asking
from rapp_nao_sim.world.moves import posture_time
from rapp_nao_sim.world.postures import FAMILIES, load


@qi.multiThreaded()
class ALRobotPosture(Module):
    """Predefined postures."""

    def __init__(self, world: World) -> None:
        self.__world = world
        self.__postures = load()

    @asking
    def goToPosture(self, name: str, speed: float) -> bool:  # noqa: N802
        """Take a posture from any other, at a speed from 0 to 1; ends there, gives whether it is reached."""
        return self.__world.set_posture(name, number(speed))

    @asking
    def applyPosture(self, name: str, speed: float) -> bool:  # noqa: N802
        """Bring the joints to a posture's angles, without care for balance; gives whether the robot is in it then."""
        if name not in self.__postures or not 0 < number(speed) <= 1:
            raise NaoqiError(f"cannot apply posture {name!r} at speed {speed}: known are {', '.join(self.__postures)}; speed to 1")
        goal = dict(self.__postures[name].angles)
        found = list(goal)
        start = dict(zip(found, self.__world.joint_angles(found), strict=True))
        seconds = posture_time(start, goal, 0.0, number(speed))
        self.__world.move_joints(found, [[angle] for angle in goal.values()], [[seconds]] * len(found))
        return self.__world.posture()[0] == name

    @asking
    def stopMove(self) -> None:  # noqa: N802
        """End a change of posture at once."""
        self.__world.stop_posture()

    def setMaxTryNumber(self, _most: int) -> None:  # noqa: N802
        """Accepted: this robot takes a posture the first time, or not at all."""

    @asking
    def getPosture(self) -> str:  # noqa: N802
        """The posture the robot is in, "Unknown" in between."""
        return self.__world.posture()[0]

    @asking
    def getPostureFamily(self) -> str:  # noqa: N802
        """The family of the posture the robot is in."""
        return self.__world.posture()[1]

    @asking
    def getPostureList(self) -> list[str]:  # noqa: N802
        """The predefined postures."""
        return list(self.__postures)

    @asking
    def getPostureFamilyList(self) -> list[str]:  # noqa: N802
        """The families of postures."""
        return list(FAMILIES)
