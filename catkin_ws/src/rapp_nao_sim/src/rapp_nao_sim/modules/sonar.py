"""ALSonar: the sonars measure while somebody is subscribed."""

import threading

import qi

from rapp_nao_sim.naoqi import Module, NaoqiError, working
from rapp_nao_sim.world.process import WorldClient

PERIOD = 100  # ms between two measures
SIDES = ("Left", "Right")
KEYS = [f"Device/SubDeviceList/US/{side}/Sensor/Value" for side in SIDES]
EVENTS = [f"Sonar{side}{what}" for side in SIDES for what in ("Detected", "NothingDetected")]


@qi.multiThreaded()
class ALSonar(Module):
    """Keys Device/SubDeviceList/US/Left|Right/Sensor/Value (m; 5.0: no echo); events SonarLeftDetected and its like."""

    def __init__(self, world: WorldClient) -> None:
        self.__world = world
        self.__lock = threading.Lock()
        self.__subscribers: set[str] = set()

    @working
    def subscribe(self, name: str, *_period_and_precision: float) -> None:
        """Have the sonars measure for `name`."""
        with self.__lock:
            self.__subscribers.add(name)
            self.__world.set_sonar(True)

    @working
    def unsubscribe(self, name: str) -> None:
        """Not for `name` any more; the last one stops them."""
        with self.__lock:
            if name not in self.__subscribers:
                raise NaoqiError(f"{name} is not subscribed")
            self.__subscribers.discard(name)
            self.__world.set_sonar(bool(self.__subscribers))

    def getSubscribersInfo(self) -> list[list[object]]:  # noqa: N802
        """Name, period and precision of each subscriber."""
        with self.__lock:
            return [[name, PERIOD, 0.0] for name in sorted(self.__subscribers)]

    def getCurrentPeriod(self) -> int:  # noqa: N802
        """ms between two measures."""
        return PERIOD

    def getOutputNames(self) -> list[str]:  # noqa: N802
        """What it tells in ALMemory: the same as getEventList and getMemoryKeyList together."""
        return [*EVENTS, *KEYS]

    def getEventList(self) -> list[str]:  # noqa: N802
        """The events it raises."""
        return list(EVENTS)

    def getMemoryKeyList(self) -> list[str]:  # noqa: N802
        """The keys it writes."""
        return list(KEYS)

    @working
    def getFilteredValues(self) -> list[float]:  # noqa: N802
        """Distances right and left, m."""
        echoes = self.__world.feelings().echoes
        return [echoes["Right"][0], echoes["Left"][0]]
