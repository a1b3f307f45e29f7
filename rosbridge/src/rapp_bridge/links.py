"""TCPROS connections on the event loop: to publishers and services of ROS, and from subscribers and callers of ROS."""

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

from rapp_bridge.decoding import Raw
from rapp_bridge.errors import BridgeError, Invalid, Unreachable
from rapp_bridge.newest import Newest
from rapp_bridge.tcpros import HeaderReader, Splitter, encode_header

HIGH_WATER = 1 << 20  # bytes given to the system at once


class Outgoing(asyncio.BufferedProtocol):
    """A connection that we open: our header, theirs, then messages. `opened` ends with their header, or with Unreachable."""

    def __init__(self, header: dict[str, str], limit: int, *, has_status: bool = False) -> None:
        """`limit`: bytes of one message."""
        self._header = header
        self._head = HeaderReader()
        self._splitter = Splitter(limit, has_status=has_status)
        self.opened: asyncio.Future[dict[str, str]] = asyncio.get_running_loop().create_future()
        self.fields: dict[str, str] = {}
        self.is_open = True
        self.on_opened: Callable[[], object] = lambda: None
        self.on_message: Callable[[Raw], object] = lambda raw: None
        self.on_lost: Callable[[], object] = lambda: None

    async def connect(self, address: tuple[str, int], seconds: float) -> dict[str, str]:
        """Connect and shake hands; gives their header. Raises Unreachable."""
        loop = asyncio.get_running_loop()
        try:
            async with asyncio.timeout(seconds):
                await loop.create_connection(lambda: self, *address)
                return await self.opened
        except (OSError, TimeoutError) as error:
            self.close()
            raise Unreachable(f"cannot connect to {address[0]}:{address[1]}: {error or f'no answer in {seconds:g} s'}") from error

    def connection_made(self, transport: Any) -> None:
        """Connected: send our header."""
        self.transport = transport
        transport.write(encode_header(self._header))

    def get_buffer(self, _hint: int) -> memoryview:
        """Where the next bytes go."""
        return self._splitter.buffer()

    def buffer_updated(self, count: int) -> None:
        """Bytes have come."""
        try:
            messages = self._splitter.filled(count) if self.fields else self._shake_hands(count)
        except Invalid as error:
            self._fail(str(error))
            return
        for raw in messages:
            self.on_message(raw)

    def _shake_hands(self, count: int) -> list[Raw]:
        """Read their header; gives the messages that came with it."""
        found = self._head.feed(bytes(self._splitter.buffer()[:count]))
        if found is None:
            return []
        fields, rest = found
        self.fields = fields or {"": ""}
        if "error" in fields:
            raise Invalid(fields["error"])
        self.on_opened()
        if not self.opened.done():
            self.opened.set_result(self.fields)
        return self._splitter.feed(rest)

    def hold(self, on: bool) -> None:
        """Stop reading, or read on."""
        if self.is_open and self.transport.is_reading() == on:
            (self.transport.pause_reading if on else self.transport.resume_reading)()

    def _fail(self, text: str) -> None:
        if not self.opened.done():
            self.opened.set_exception(Unreachable(f"cannot connect: {text}"))
        self.close()

    def connection_lost(self, error: Exception | None) -> None:
        """The other side is gone."""
        self.is_open = False
        if not self.opened.done():
            self.opened.set_exception(Unreachable(f"cannot connect: {error or 'the other side closed the connection'}"))
        self.on_lost()

    def close(self) -> None:
        """Close it."""
        self.is_open = False
        if hasattr(self, "transport"):
            self.transport.close()


class SubscriberLink(asyncio.Protocol):
    """A ROS subscriber of a topic that clients publish; it loses its oldest messages when it reads too slowly."""

    def __init__(
        self, transport: Any, queue_size: int, limit: int, lost: Callable[["SubscriberLink"], object], dropped: Callable[[], object]
    ) -> None:
        """At most `queue_size` messages and `limit` bytes wait; `dropped` is told when the bytes are too many."""
        self._transport = transport
        self._waiting = Newest(queue_size, limit)
        self._is_paused = False
        self._lost = lost
        self._dropped = dropped
        transport.set_write_buffer_limits(HIGH_WATER)

    def send(self, framed: bytes) -> None:
        """Send a message with its length in front."""
        if not self._is_paused:
            self._transport.write(framed)
            return
        _too_many, too_long = self._waiting.add(framed)
        if too_long:
            self._dropped()

    def data_received(self, data: bytes) -> None:
        """Subscribers say nothing after their header."""

    def pause_writing(self) -> None:
        """It reads more slowly than it is sent to."""
        self._is_paused = True

    def resume_writing(self) -> None:
        """It has caught up."""
        self._is_paused = False
        while self._waiting and not self._is_paused:
            self._transport.write(self._waiting.take())

    def connection_lost(self, _error: Exception | None) -> None:
        """It is gone."""
        self._lost(self)

    def close(self) -> None:
        """Close it."""
        self._transport.close()


class Welcome(NamedTuple):
    """How a connection goes on that another node has opened."""

    header: dict[str, str]  # ours
    protocol: asyncio.Protocol | None  # None: it is closed
    begin: Callable[[], object] = lambda: None  # called when the protocol is in place


Answer = Callable[[bytes | bytearray | BridgeError], None]
Serve = Callable[[Raw, Answer], None]


class CallerLink(asyncio.Protocol):
    """A ROS caller of a service that clients, or the bridge itself, provide. Its requests are served one after another."""

    def __init__(self, transport: Any, serve: Serve, limit: int, *, is_persistent: bool) -> None:
        self._transport = transport
        self._serve = serve
        self._splitter = Splitter(limit)
        self._requests: deque[Raw] = deque()
        self._is_busy = False
        self._is_persistent = is_persistent

    def data_received(self, data: bytes) -> None:
        """A request, or a part of one."""
        try:
            self._requests.extend(self._splitter.feed(data))
        except Invalid as error:
            self._answer(error)
            self._transport.close()
            return
        self._next()

    def _next(self) -> None:
        if self._requests and not self._is_busy:
            self._is_busy = True
            self._serve(self._requests.popleft(), self._answer)

    def _answer(self, outcome: bytes | bytearray | BridgeError) -> None:
        ok = not isinstance(outcome, BridgeError)
        body = outcome if not isinstance(outcome, BridgeError) else str(outcome).encode(errors="replace")
        self._transport.write(bytes((ok,)) + len(body).to_bytes(4, "little") + body)
        self._is_busy = False
        if self._is_persistent:
            self._next()
        else:
            self._transport.close()
