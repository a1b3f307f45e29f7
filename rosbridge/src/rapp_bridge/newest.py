"""Messages that wait: as many and as long as are allowed, the newest of them."""

from collections import deque
from collections.abc import Iterator


class Newest:
    """A queue of framed messages that loses its oldest when there are too many or they are too long; the newest always stays."""

    def __init__(self, most: int, limit: int) -> None:
        """At most `most` messages, of `limit` bytes together."""
        self._most = most
        self._limit = limit
        self._messages: deque[bytes] = deque()
        self._size = 0  # bytes

    def __len__(self) -> int:
        return len(self._messages)

    def __iter__(self) -> Iterator[bytes]:
        return iter(self._messages)

    def add(self, framed: bytes) -> tuple[bool, bool]:
        """Add one; gives whether any was lost because there were too many, and whether because they were too long."""
        self._messages.append(framed)
        self._size += len(framed)
        if too_many := len(self._messages) > self._most:
            self.take()
        too_long = False
        while self._size > self._limit and len(self._messages) > 1:
            too_long = True
            self.take()
        return too_many, too_long

    def take(self) -> bytes:
        """The oldest, which waits no longer."""
        framed = self._messages.popleft()
        self._size -= len(framed)
        return framed

    def clear(self) -> None:
        """Nothing waits any more."""
        self._messages.clear()
        self._size = 0
