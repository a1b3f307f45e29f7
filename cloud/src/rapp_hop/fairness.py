"""What one caller may take from the others: calls per second, each caller having its own bucket (input H15). Pure."""

from collections import OrderedDict
from collections.abc import Callable

from rapp_hop.errors import Unreachable
from rapp_hop.protocol import TURNED_AWAY

CALLERS = 10_000  # remembered


class Fairness:
    """Buckets that fill with `rate` calls per second up to `burst`."""

    def __init__(self, rate: float, burst: float, clock: Callable[[], float]) -> None:
        self._rate = rate
        self._burst = burst
        self._clock = clock
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()  # left, when

    def admit(self, caller: str) -> None:
        """Count one call.

        :raises Unreachable: with status 429, when the caller's bucket is empty; nothing has run then
        """
        now = self._clock()
        left, when = self._buckets.get(caller, (self._burst, now))
        left = min(self._burst, left + (now - when) * self._rate)
        if left < 1:
            error = Unreachable(f"cannot serve more than {self._rate:g} calls per second of one caller: try again later", 429)
            error.reason = TURNED_AWAY
            raise error
        self._buckets[caller] = (left - 1, now)
        self._buckets.move_to_end(caller)
        if len(self._buckets) > CALLERS:
            self._buckets.popitem(last=False)


class Brake:
    """Lets through so many lines of a log per second, and counts the others (input H08)."""

    def __init__(self, rate: int, clock: Callable[[], float]) -> None:
        self.held_back = 0
        self._rate = rate
        self._clock = clock
        self._second = -1
        self._count = 0

    def allows(self) -> bool:
        """Count one line; whether it may be written."""
        second = int(self._clock())
        if second != self._second:
            self._second, self._count = second, 0
        self._count += 1
        if self._count > self._rate:
            self.held_back += 1
            return False
        return True
