"""The queue of what waits to be sent to one client: bounded, and a slow client loses only its own oldest messages."""

from collections import OrderedDict, deque
from collections.abc import Callable
from itertools import count
from typing import Generic, NamedTuple, TypeVar

Item = TypeVar("Item")

OVERHEAD = 200  # bytes that a waiting item costs beside its own


class _Waiting(NamedTuple, Generic[Item]):
    topic: str | None
    item: Item
    size: int


class Outbox(Generic[Item]):
    """Items in order of arrival, of at most `limit` bytes; knows no socket.

    `lost` is told the topic of each message that is dropped. When items that may not be dropped exceed the limit, `keep`
    gives False, and from then on nothing is queued.
    """

    def __init__(self, limit: int, lost: Callable[[str], None]) -> None:
        self._limit = limit
        self._lost = lost
        self._numbers = count()
        self._items: OrderedDict[int, _Waiting[Item]] = OrderedDict()
        self._topics: dict[str, deque[int]] = {}
        self._closed = False
        self.waiting = 0  # bytes

    def __len__(self) -> int:
        return len(self._items)

    def keep(self, item: Item, size: int) -> bool:
        """Queue an item of so many bytes that may not be dropped; False when the client has to go."""
        self._put(None, item, size)
        if self.waiting > self._limit:
            self.close()
        return not self._closed

    def offer(self, topic: str, item: Item, size: int, queue_length: int) -> None:
        """Queue a message of `topic`, of which at most `queue_length` (0: any number) are kept: the newest."""
        if self._closed:
            return
        self._put(topic, item, size)
        if 0 < queue_length < len(self._topics[topic]):
            self._drop(topic)

    def take(self) -> Item | None:
        """Give the next item; None when nothing waits."""
        return self._remove(next(iter(self._items))).item if self._items else None

    def close(self) -> None:
        """Forget all items and queue no more."""
        self._closed = True
        self._items.clear()
        self._topics.clear()
        self.waiting = 0

    def _put(self, topic: str | None, item: Item, size: int) -> None:
        if self._closed:
            return
        number = next(self._numbers)
        self._items[number] = _Waiting(topic, item, size + OVERHEAD)
        self.waiting += size + OVERHEAD
        if topic is not None:
            self._topics.setdefault(topic, deque()).append(number)
        while self.waiting > self._limit and self._topics:
            self._drop(min(self._topics, key=lambda name: self._topics[name][0]))

    def _drop(self, topic: str) -> None:
        self._remove(self._topics[topic][0])
        self._lost(topic)

    def _remove(self, number: int) -> _Waiting[Item]:
        waiting = self._items.pop(number)
        self.waiting -= waiting.size
        if waiting.topic is not None:
            numbers = self._topics[waiting.topic]
            numbers.popleft()  # only ever the oldest of its topic is removed
            if not numbers:
                del self._topics[waiting.topic]
        return waiting
