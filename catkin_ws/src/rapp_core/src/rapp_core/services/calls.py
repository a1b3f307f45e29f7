"""The calls that move the robot, or wait for the limbs they move: each can be ended from outside, all by one word."""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from rapp_core.errors import Refused

LIMBS = frozenset({"legs", "arms", "head"})
"""Resources of the body that move."""


class Call:
    """One call of a service."""

    def __init__(self, feedback: Callable[[Mapping[str, Any]], None] | None = None, older: Sequence["Call"] = ()) -> None:
        """`feedback` is told how far the call is, from the thread that executes it; `older` are ended once it is found of use."""
        self.feedback = feedback
        self._older = older
        self.yields = False
        """Whether it gives way to the next call that wants one of its limbs."""
        self.puts_back = False
        """Whether it is the core agent's own, which leaves the robot as a RApp has found it."""
        self._reason: str | None = None

    def end(self, reason: str) -> None:
        """End the call, which its caller is told as refused for this reason; the first one counts."""
        if self._reason is None:
            self._reason = reason

    def take_over(self, reason: str) -> None:
        """End the older calls that this one was made in place of."""
        older, self._older = self._older, ()
        for call in older:
            call.end(reason)

    @property
    def ended(self) -> bool:
        """Whether it has been ended."""
        return self._reason is not None

    def check(self) -> None:
        """Raise Refused when the call has been ended."""
        if self._reason is not None:
            raise Refused(f"cannot finish: {self._reason}")


class Calls:
    """All calls that move the robot at this moment, and how the robot was before any had since the last `take_before`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._open: list[tuple[Call, frozenset[str]]] = []
        self._before: str | None = None
        self._end: tuple[object, str] | None = None

    @contextmanager
    def entered(self, call: Call, limbs: Sequence[str]) -> Iterator[None]:
        """While the call moves limbs, or waits for them."""
        entry = (call, frozenset(limbs))
        with self._lock:
            self._open.append(entry)
        try:
            yield
        finally:
            with self._lock:
                self._open.remove(entry)

    def end(self, reason: str) -> None:
        """End all calls."""
        for call, _limbs in self._now():
            call.end(reason)

    def make_way(self, newcomer: Call, limb: str, everyone: bool, reason: str) -> None:
        """End the calls that have a limb which a newcomer wants: those that yield, or `everyone`."""
        for call, taken in self._now():
            if (call.yields or everyone) and limb in taken and call is not newcomer:
                call.end(reason)

    def note_before(self, posture: Callable[[], str]) -> None:
        """The robot is about to be made to move; the first one counts."""
        if self._before is None:
            self._before = posture()

    def take_before(self) -> str | None:
        """The posture before the robot was made to move; None when it was not since this was asked the last time."""
        before, self._before = self._before, None
        return before

    def keep_before(self, posture: str) -> None:
        """The robot has not come back to a posture that was taken from here; whatever was noted since counts less."""
        self._before = posture

    def note_end(self, caller: object, reason: str) -> None:
        """What went on for a caller after its reply has ended by itself; the last one counts."""
        self._end = (caller, reason)

    def take_end(self, caller: object) -> str:
        """Why what went on for a caller has ended by itself, told once; "" when it has not."""
        if self._end is None or self._end[0] is not caller:
            return ""
        (_caller, reason), self._end = self._end, None
        return reason

    def _now(self) -> list[tuple[Call, frozenset[str]]]:
        with self._lock:
            return list(self._open)
