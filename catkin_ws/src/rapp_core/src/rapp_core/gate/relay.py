"""Connections of TCPROS from side to side: whole buffers are passed on, and only their lengths are looked at."""

import asyncio
import contextlib
import logging
import socket
import time
from collections.abc import Awaitable, Callable
from typing import cast

from rapp_core.errors import CoreError, Invalid, Unreachable
from rapp_core.gate.bounds import HEADER, REQUEST, Frames, Pace, encode_header, header_in

HANDSHAKE = 5.0  # s for each header
CONNECT = 3.0  # s

_log = logging.getLogger(__name__)


class Side(asyncio.Protocol):
    """One end of a relayed connection: first its header, then, once `join`ed, all that comes goes to the other end."""

    def __init__(self, pace: Pace | None = None) -> None:
        """`pace`: how often a message may begin here, and that each has its limit; None for who is trusted."""
        self._pace = pace
        self._frames = Frames(REQUEST) if pace is not None else None
        self._early = b""
        self._header: asyncio.Future[dict[str, str] | None] = asyncio.get_running_loop().create_future()
        self._other: Side | None = None
        self._holds: set[str] = set()  # reasons not to read
        self.mute = False
        """Whether nothing may come from here: a subscriber has nothing to say."""
        self.gone = asyncio.Event()

    # asyncio.Protocol

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Both event loops set TCP_NODELAY themselves."""
        self.transport = cast(asyncio.Transport, transport)  # uvloop's own class is none of asyncio's

    def data_received(self, data: bytes) -> None:
        """Gather the header, or pass on."""
        try:
            if self._other is not None:
                self._pass_on(data)
                return
            self._early += data
            found = header_in(self._early) if not self._header.done() else None
            if found is not None:
                fields, self._early = found
                self._header.set_result(fields)
            if self._header.done() or len(self._early) > HEADER + 4:
                self.hold("header")
        except Invalid as error:
            _log.warning("a connection is ended: %s", error)
            self.transport.abort()

    def pause_writing(self) -> None:
        """This end is slow: the other waits."""
        if self._other is not None:
            self._other.hold("slow")

    def resume_writing(self) -> None:
        """It has caught up."""
        if self._other is not None:
            self._other.release("slow")

    def connection_lost(self, error: Exception | None) -> None:
        """One end's end is the other's, after what was sent before."""
        self.gone.set()
        if not self._header.done():
            self._header.set_result(None)
        if self._other is not None:
            self._other.transport.close()

    # for whoever brings two together

    async def header(self) -> dict[str, str]:
        """The header that this end has sent. Raises Unreachable."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(HANDSHAKE):
                fields = await asyncio.shield(self._header)
            if fields is not None:
                return fields
        raise Unreachable("cannot connect: no connection header came")

    def send(self, fields: dict[str, str]) -> None:
        """Send a header to this end."""
        self.transport.write(encode_header(fields))

    def refuse(self, text: str) -> None:
        """Tell this end why it gets no connection, and end."""
        if not self.transport.is_closing():
            self.send({"error": text})
            self.transport.close()

    def join(self, other: "Side") -> None:
        """From now on both are one connection."""
        self._other, other._other = other, self
        for side in (self, other):
            early, side._early = side._early, b""
            if early:
                side.data_received(early)
            if side.gone.is_set():
                other.transport.close()
                self.transport.close()
            else:
                side.release("header")

    def hold(self, reason: str) -> None:
        """Read no more until `release`."""
        if not self._holds and not self.transport.is_closing():
            self.transport.pause_reading()
        self._holds.add(reason)

    def release(self, reason: str) -> None:
        """Undo `hold`."""
        was = bool(self._holds)
        self._holds.discard(reason)
        if was and not self._holds and not self.transport.is_closing():
            self.transport.resume_reading()

    def _pass_on(self, data: bytes) -> None:
        assert self._other is not None
        if self.mute:
            raise Invalid("cannot take messages from a subscriber")
        if self._frames is not None and self._pace is not None:
            begun = self._frames.feed(data)
            wait = self._pace.take(begun) if begun else 0.0
            if wait > 0:
                self.hold("pace")
                asyncio.get_running_loop().call_later(wait, self.release, "pace")
        if not self._other.transport.is_closing():
            self._other.transport.write(data)


Meet = Callable[[Side], Awaitable[None]]
"""What is done with a new connection: it returns when both ends are joined. Raises CoreError with what the caller is told."""


class Doorway:
    """Accepts connections at a listener, so many at once and so many in a second; who comes beyond that waits."""

    def __init__(self, listener: socket.socket, meet: Meet, most: int, rate: float, message_pace: Pace | None) -> None:
        """`message_pace`: of those who come in, see `Side`."""
        self._listener = listener
        self._meet = meet
        self._room = asyncio.Semaphore(most)
        self._pace = Pace(rate, time.monotonic)
        self._message_pace = message_pace
        self._tasks: set[asyncio.Task[None]] = set()

    async def serve(self) -> None:
        """Serve until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            await self._room.acquire()
            await asyncio.sleep(self._pace.take())
            connection, _ = await loop.sock_accept(self._listener)
            _, side = await loop.connect_accepted_socket(lambda: Side(self._message_pace), connection)
            task = loop.create_task(self._receive(side))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _receive(self, side: Side) -> None:
        try:
            await self._meet(side)
            await side.gone.wait()
        except CoreError as error:
            side.refuse(str(error))
        finally:
            side.transport.close()
            self._room.release()


async def reach(address: tuple[str, int] | None, connection: socket.socket | None = None, pace: Pace | None = None) -> Side:
    """Connect to an address, or take a connected socket. Raises Unreachable."""
    loop = asyncio.get_running_loop()
    try:
        async with asyncio.timeout(CONNECT):
            if connection is None:
                assert address is not None
                return (await loop.create_connection(lambda: Side(pace), *address))[1]
            if address is not None:
                await loop.sock_connect(connection, address)
            return (await loop.create_connection(lambda: Side(pace), sock=connection))[1]
    except (OSError, TimeoutError) as error:
        if connection is not None:
            connection.close()
        raise Unreachable(f"cannot connect: {error}") from error
