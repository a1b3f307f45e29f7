"""What goes to one client: written at once while it reads, queued while it does not."""

import asyncio
import logging
from collections.abc import Callable
from typing import Any

from rapp_bridge.arrival import Arrival, Background, Wire
from rapp_bridge.errors import BridgeError
from rapp_bridge.outbox import Outbox
from rapp_bridge.protocol import Level
from rapp_bridge.websocket import NORMAL, POLICY, Frame, close_frame

HIGH_WATER = 1 << 18  # bytes given to the system at once; what waits beyond them can still be dropped
TOLD_AGAIN = 1.0  # s between statuses about messages that could not be sent

_log = logging.getLogger(__name__)


class Sender:
    """Writes frames in order; topic messages are encoded when their turn comes."""

    def __init__(
        self,
        transport: Any,
        limit: int,
        background: Background,
        tell: Callable[[Level, str], None],
        end: Callable[[int, str], None],
    ) -> None:
        """`limit`: bytes that may wait; `tell` sends a status; `end` closes the connection with a code and a reason."""
        self._transport = transport
        self._background = background
        self._tell = tell
        self._end = end
        self._limit = limit
        self._writable = True
        self._outbox: Outbox[Frame | tuple[Arrival, Wire]] = Outbox(limit, self._lost)
        self._next: tuple[Arrival, Wire] | None = None  # goes before what the outbox has, once it is encoded
        self._told = float("-inf")
        self._closed = False
        self._given_up = False
        self._caught_up: list[Callable[[], object]] = []
        transport.set_write_buffer_limits(HIGH_WATER)

    def send(self, frame: Frame) -> None:
        """Write or queue what may not be dropped; a client that lets too much wait is cut off."""
        if self._closed:
            return
        if self._writable and not self._outbox and self._next is None:
            self._write(frame)
        elif not self._outbox.keep(frame, sum(map(len, frame))):
            _log.warning("client disconnected: more than %d bytes of answers waited for it", self._limit)
            self._end(POLICY, f"cannot keep more than {self._limit} bytes of answers for you; read faster, or ask less")

    def offer(self, arrival: Arrival, wire: Wire, queue_length: int) -> None:
        """Write or queue a topic's message."""
        if self._closed:
            return
        if self._writable and not self._outbox and self._next is None:
            self._write_arrival(arrival, wire)
        else:
            size = 2 * len(arrival.raw)  # the message itself and, when another client has had it, its encoding
            self._outbox.offer(wire.topic, (arrival, wire), size, queue_length)

    @property
    def is_behind(self) -> bool:
        """Whether more than half of what may wait does, and the client was not waited for in vain."""
        return not self._given_up and self._outbox.waiting > self._limit // 2

    @property
    def is_preparing(self) -> bool:
        """Whether what goes next is still being encoded."""
        return self._next is not None

    def when_caught_up(self, call: Callable[[], object]) -> None:
        """Have this called once, when little waits, or the client is gone."""
        self._caught_up.append(call)

    def give_up(self) -> None:
        """It was waited for in vain."""
        self._given_up = True

    def pause(self) -> None:
        """The client reads more slowly than it is sent to."""
        self._writable = False

    def resume(self) -> None:
        """The client has caught up."""
        self._writable = True
        self._flush()

    def farewell(self, code: int, reason: str) -> None:
        """Send a close frame as the last one.

        Unless the client asked for it, the socket stays open on its side: closed over bytes of it that nobody has read, it would
        be reset, and the reason with it.
        """
        if not self._closed:
            self._write(close_frame(code, reason))
            self.close()
            if code != NORMAL and self._transport.can_write_eof():
                self._transport.write_eof()
            else:
                self._transport.close()

    def close(self) -> None:
        """Send nothing more."""
        self._closed = True
        self._next = None
        self._outbox.close()
        self._tell_caught_up()

    def _flush(self) -> None:
        if self._next is not None:
            (arrival, wire), self._next = self._next, None
            self._write_arrival(arrival, wire)
        while self._writable and self._next is None and not self._closed:
            item = self._outbox.take()
            if item is None:
                self._given_up = False
                break
            if isinstance(item[0], Arrival):
                self._write_arrival(item[0], item[1])
            else:
                self._write(item)
        if self._caught_up and self._outbox.waiting <= self._limit // 4:
            self._tell_caught_up()

    def _tell_caught_up(self) -> None:
        calls, self._caught_up = self._caught_up, []
        for call in calls:
            call()

    def _write_arrival(self, arrival: Arrival, wire: Wire) -> None:
        if not arrival.is_ready(wire, self._background, self._flush):
            self._next = (arrival, wire)
            return
        try:
            frame = arrival.frame(wire)
        except BridgeError as error:
            self._tell_sometimes("error", str(error))
            return
        self._write(frame)

    def _write(self, frame: Frame) -> None:
        if len(frame) == 1:
            self._transport.write(frame[0])
        else:
            self._transport.writelines(frame)

    def _lost(self, topic: str) -> None:
        self._tell_sometimes("warning", f"cannot keep the messages of {topic}: you read too slowly; the oldest are dropped")

    def _tell_sometimes(self, level: Level, text: str) -> None:
        now = asyncio.get_running_loop().time()
        if now - self._told > TOLD_AGAIN:
            self._told = now
            self._tell(level, text)
