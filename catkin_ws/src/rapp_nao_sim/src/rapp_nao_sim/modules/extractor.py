"""What extractors (sonars, recognition of words, detection of sounds) have in common: who wants them, and what they tell."""

import threading
from collections.abc import Callable, Sequence

from rapp_nao_sim.naoqi import Module, NaoqiError, quick, working

Change = Callable[[str, bool], None]  # a name wants the extractor, or does not any more; raises a SimError


class Extractor(Module):
    """It tells ALMemory its events and keys while somebody is subscribed.

    The period and the precision that a subscriber asks for are kept and told; the extractor has a pace of its own.
    """

    def __init__(self, change: Change, period: int, events: Sequence[str], keys: Sequence[str] = ()) -> None:
        self.__change = [change]  # in a list: qi would expose a bare callable attribute
        self.__period = period
        self.__events, self.__keys = list(events), list(keys)
        self.__lock = threading.Lock()
        self.__subscribers: dict[str, tuple[int, float]] = {}

    @working
    def subscribe(self, name: str, period: int = 0, precision: float = 0.0) -> None:
        """Have it work for `name`; without a period (ms), or with 0, at its own."""
        wish = int(period) or self.__period, float(precision)
        with self.__lock:
            self.__change[0](name, True)
            self.__subscribers[name] = wish

    @working
    def unsubscribe(self, name: str) -> None:
        """Not for `name` any more; the last one stops it."""
        with self.__lock:
            self.__change[0](name, False)
            self.__subscribers.pop(name, None)

    @quick
    def updatePeriod(self, name: str, period: int) -> None:  # noqa: N802
        """Change the period (ms) that a subscriber has asked for."""
        with self.__lock:
            self.__subscribers[name] = int(period), self.__find(name)[1]

    @quick
    def updatePrecision(self, name: str, precision: float) -> None:  # noqa: N802
        """Change the precision that a subscriber has asked for."""
        with self.__lock:
            self.__subscribers[name] = self.__find(name)[0], float(precision)

    @quick
    def getMyPeriod(self, name: str) -> int:  # noqa: N802
        """The period (ms) that a subscriber has asked for."""
        return self.__find(name)[0]

    @quick
    def getMyPrecision(self, name: str) -> float:  # noqa: N802
        """The precision that a subscriber has asked for."""
        return self.__find(name)[1]

    def getSubscribersInfo(self) -> list[list[object]]:  # noqa: N802
        """Name, period and precision of each subscriber, as they have asked for them."""
        with self.__lock:
            return [[name, *wish] for name, wish in sorted(self.__subscribers.items())]

    def getCurrentPeriod(self) -> int:  # noqa: N802
        """ms between two measures, whatever was asked for."""
        return self.__period

    def getOutputNames(self) -> list[str]:  # noqa: N802
        """What it tells in ALMemory: the same as getEventList and getMemoryKeyList together."""
        return [*self.__events, *self.__keys]

    def getEventList(self) -> list[str]:  # noqa: N802
        """The events it raises."""
        return list(self.__events)

    def getMemoryKeyList(self) -> list[str]:  # noqa: N802
        """The keys it writes."""
        return list(self.__keys)

    def __find(self, name: str) -> tuple[int, float]:
        if name not in self.__subscribers:
            raise NaoqiError(f"{name} is not subscribed")
        return self.__subscribers[name]
