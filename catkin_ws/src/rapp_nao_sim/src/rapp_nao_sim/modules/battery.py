"""ALBattery."""

import qi

from rapp_nao_sim.naoqi import Module, working
from rapp_nao_sim.world.process import WorldClient


@qi.multiThreaded()
class ALBattery(Module):
    """The battery's charge; event BatteryChargeChanged."""

    def __init__(self, world: WorldClient) -> None:
        self.__world = world

    @working
    def getBatteryCharge(self) -> int:  # noqa: N802
        """In percent."""
        return round(self.__world.feelings().charge * 100)
