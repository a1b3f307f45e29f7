"""The queue of what waits to be sent to one client: bounded, and a slow client loses only its own oldest messages."""

import threading
from collections import OrderedDict, deque
from collections.abc import Callable
from itertools import count


class Outbox:
    """Frames in order of arrival. Filled by any thread, emptied by one; knows no socket.

    `wake` is called once when something comes while the reader sleeps (it sleeps when `take` gave None). `overflow` is
    called once when frames that may not be dropped exceed `limit` bytes; from then on nothing is queued.
    """

    def __init__(self, limit: int, wake: Callable[[], None], overflow: Callable[[], None]) -> None:
        self._limit = limit
        self._wake = wake
        self._overflow = overflow
        self._lock = threading.Lock()
        self._numbers = count()
        self._frames: OrderedDict[int, tuple[str | None, bytes]] = OrderedDict()
        self._topics: dict[str, deque[int]] = {}
        self._asleep = False
        self._closed = False
        self.waiting = 0  # bytes

    def keep(self, frame: bytes) -> None:
        """Queue a frame that may not be dropped."""
        self._put(None, frame, 0)

    def offer(self, topic: str, frame: bytes, queue_length: int) -> None:
        """Queue a frame of `topic`, of which at most `queue_length` (1 or more) are kept: the newest."""
        self._put(topic, frame, queue_length)

    def take(self) -> bytes | None:
        """Give the next frame; None when nothing waits."""
        with self._lock:
            if not self._frames:
                self._asleep = True
                return None
            return self._remove(next(iter(self._frames)))

    def close(self) -> None:
        """Forget all frames and queue no more."""
        with self._lock:
            self._closed = True
            self._frames.clear()
            self._topics.clear()
            self.waiting = 0

    def _put(self, topic: str | None, frame: bytes, queue_length: int) -> None:
        with self._lock:
            if self._closed:
                return
            number = next(self._numbers)
            self._frames[number] = (topic, frame)
            self.waiting += len(frame)
            if topic is not None:
                numbers = self._topics.setdefault(topic, deque())
                numbers.append(number)
                if len(numbers) > queue_length:
                    self._remove(numbers[0])
            self._drop_to_limit()
            overflown = self._closed = self.waiting > self._limit
            wake, self._asleep = self._asleep, False
        if overflown:
            self.close()
            self._overflow()
        elif wake:
            self._wake()

    def _drop_to_limit(self) -> None:
        while self.waiting > self._limit and self._topics:
            self._remove(min(numbers[0] for numbers in self._topics.values()))

    def _remove(self, number: int) -> bytes:
        topic, frame = self._frames.pop(number)
        self.waiting -= len(frame)
        if topic is not None:
            numbers = self._topics[topic]
            numbers.popleft()  # only ever the oldest of its topic is removed
            if not numbers:
                del self._topics[topic]
        return frame
