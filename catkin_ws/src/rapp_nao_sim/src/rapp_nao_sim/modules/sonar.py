"""ALSonar: the sonars measure while somebody is subscribed."""

import qi

from rapp_nao_sim.modules.extractor import Extractor
from rapp_nao_sim.naoqi import NaoqiError, working
from rapp_nao_sim.world.process import WorldClient

PERIOD = 100  # ms between two measures
SIDES = ("Left", "Right")
KEYS = [f"Device/SubDeviceList/US/{side}/Sensor/Value" for side in SIDES]
EVENTS = [f"Sonar{side}{what}" for side in SIDES for what in ("Detected", "NothingDetected")]


@qi.multiThreaded()
class ALSonar(Extractor):
    """Keys Device/SubDeviceList/US/Left|Right/Sensor/Value (m; 5.0: no echo); events SonarLeftDetected and its like."""

    def __init__(self, world: WorldClient) -> None:
        self.__world = world
        wanting: set[str] = set()

        def change(name: str, on: bool) -> None:
            if not on and name not in wanting:
                raise NaoqiError(f"{name} is not subscribed")
            (wanting.add if on else wanting.discard)(name)
            world.set_sonar(bool(wanting))

        super().__init__(change, PERIOD, EVENTS, KEYS)

    @working
    def getFilteredValues(self) -> list[float]:  # noqa: N802
        """Distances right and left, m."""
        echoes = self.__world.feelings().echoes
        return [echoes["Right"][0], echoes["Left"][0]]
