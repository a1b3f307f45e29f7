"""Messages that a client sends in parts, put together in any order. Pure."""

from dataclasses import dataclass, field

from rapp_bridge.errors import Invalid, Refused
from rapp_bridge.protocol import Fragment


@dataclass
class _Open:
    total: int
    since: float
    parts: dict[int, str] = field(default_factory=dict)
    size: int = 0


class Fragments:
    """The unfinished messages of one client: few, of bounded size in all, and forgotten after a while."""

    def __init__(self, limit: int, seconds: float, count: int = 16) -> None:
        """`limit`: characters of all parts that wait; `count`: messages that may be unfinished at once."""
        self._limit = limit
        self._seconds = seconds
        self._count = count
        self._open: dict[str | int, _Open] = {}

    def take(self, part: Fragment, now: float) -> str | None:
        """The whole text when this part completes it; raises Invalid or Refused, which forgets that message."""
        self._forget(now)
        try:
            return self._take(part, now)
        except (Invalid, Refused):
            self._open.pop(part.id, None)
            raise

    def _take(self, part: Fragment, now: float) -> str | None:
        if not 0 <= part.num < part.total or part.total > self._limit:
            raise Invalid(f"cannot use fragment {part.num} of {part.total}: they count from 0")
        message = self._open.get(part.id)
        if message is None:
            if len(self._open) >= self._count:
                raise Refused(f"cannot keep more than {self._count} unfinished messages; finish one first")
            message = self._open[part.id] = _Open(part.total, now)
        if message.total != part.total or message.parts.get(part.num, part.data) != part.data:
            raise Invalid(f"cannot use fragment {part.num} of {part.id!r}: it contradicts an earlier one")
        if part.num not in message.parts:
            message.parts[part.num] = part.data
            message.size += len(part.data) + 1
        if sum(each.size for each in self._open.values()) > self._limit:
            raise Refused(f"cannot keep more than {self._limit} characters of unfinished messages")
        if len(message.parts) < message.total:
            return None
        del self._open[part.id]
        return "".join(message.parts[number] for number in range(message.total))

    def _forget(self, now: float) -> None:
        for name in [name for name, message in self._open.items() if now - message.since > self._seconds]:
            del self._open[name]
