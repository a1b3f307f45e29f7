"""The half of SimWorld that acts on the robot's body."""

from rapp_nao_sim.naoqi import Module, NaoqiError, working
from rapp_nao_sim.world.process import WorldClient


class SimBody(Module):
    """What hands do to the robot."""

    def __init__(self, world: WorldClient | None) -> None:
        self.__world = world

    @working
    def touch(self, name: str, seconds: float = 0.3) -> None:
        """Touch FrontTactil, MiddleTactil, RearTactil, HandLeftBack, ..., ChestButton, LeftBumper or RightBumper for a time."""
        self.__there().touch(str(name), float(seconds))

    @working
    def pushRobot(self, x: float, y: float, seconds: float = 0.1) -> None:  # noqa: N802
        """Push the robot's torso with a force in N along the room's axes; 20 N for 0.1 s it bears, 60 N for 0.2 s throw it over."""
        self.__there().push([float(x), float(y), 0.0], float(seconds))

    @working
    def setBattery(self, charge: float) -> None:  # noqa: N802
        """Set the battery's charge from 0 to 1."""
        self.__there().set_charge(float(charge))

    @working
    def hasFallen(self) -> bool:  # noqa: N802
        """Whether the robot lies without having been told to."""
        return self.__there().fallen()

    @working
    def getLink(self, name: str) -> list[float]:  # noqa: N802
        """Where a link truly is in the room, "torso" or one of the model's: its frame as 4x4 matrix, row by row; m."""
        return self.__there().link(name)

    @working
    def getTime(self) -> float:  # noqa: N802
        """Seconds that were simulated so far: as many as have passed, unless the computer was too slow."""
        return self.__there().clock()

    @working
    def takeTouched(self) -> list[str]:  # noqa: N802
        """What of the room, but for the floor, the robot has touched since this was asked the last time: things, wall, door."""
        return self.__there().take_touched()

    def __there(self) -> WorldClient:
        if self.__world is None:
            raise NaoqiError("there is no world: nao_sim was started with --no-world")
        return self.__world
