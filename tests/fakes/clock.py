"""Time that passes only when somebody waits, and things that happen meanwhile."""

import itertools
import threading
from collections.abc import Callable


class Clock:
    """Scheduled actions run, in their order, while time is advanced."""

    def __init__(self) -> None:
        self.time = 0.0
        self._numbers = itertools.count()
        self._actions: list[tuple[float, int, Callable[[], None]]] = []

    def now(self) -> float:
        return self.time

    def at(self, time: float, action: Callable[[], None]) -> None:
        self._actions.append((time, next(self._numbers), action))

    def after(self, seconds: float, action: Callable[[], None]) -> None:
        self.at(self.time + seconds, action)

    def advance(self, seconds: float) -> None:
        end = self.time + seconds
        while due := sorted(entry for entry in self._actions if entry[0] <= end):
            self._actions.remove(due[0])
            self.time = max(self.time, due[0][0])
            due[0][2]()
        self.time = end

    def event(self) -> "TimedEvent":
        return TimedEvent(self)


class TimedEvent(threading.Event):
    """An event whose waiters let the clock's time pass."""

    def __init__(self, clock: Clock) -> None:
        super().__init__()
        self._clock = clock

    def wait(self, timeout: float | None = None) -> bool:
        if not self.is_set():
            self._clock.advance(timeout or 0.0)
        return self.is_set()
