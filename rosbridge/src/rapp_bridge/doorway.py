"""The WebSocket handshake: whom the bridge lets in."""

import asyncio
import socket
import ssl
from typing import Any

from rapp_bridge import handshake
from rapp_bridge.errors import Refused
from rapp_bridge.handshake import TurnedAwayError
from rapp_bridge.server import Connection, Hall

CROWD = 100  # clients above the limit that are told so; more are cut off without a word
MOMENT = 1.0  # s that one who is turned away has to ask, or to read why


class Doorway(asyncio.Protocol):
    """A connection until its handshake is done; it has a bounded time, and a bounded number of others beside it."""

    def __init__(self, hall: Hall, knock: socket.socket | None = None) -> None:
        """`knock`: as what it has counted until now, in `Hall.knocking`."""
        self._hall = hall
        self._knock = knock
        self._head = b""

    def connection_made(self, transport: Any) -> None:
        """A client has connected."""
        self._transport = transport
        if self._knock is not None:
            self._hall.knocking.discard(self._knock)
        self._hall.sockets.add(transport)
        excess = self._hall.excess
        self._is_full = excess > 0
        self._timer = asyncio.get_running_loop().call_later(_patience(self._hall), self._is_late)
        if excess > CROWD:
            transport.abort()

    def connection_lost(self, _error: Exception | None) -> None:
        """The client is gone before it was let in."""
        self._timer.cancel()
        self._hall.sockets.discard(self._transport)

    def data_received(self, data: bytes) -> None:
        """Take the request's head, and hand over to a connection when it is good."""
        self._head += data
        end = self._head.find(handshake.END)
        try:
            if end < 0:
                if len(self._head) > handshake.LIMIT:
                    raise TurnedAwayError("431 Request Header Fields Too Large", "cannot read so long a request")
                return
            if self._is_full:
                raise TurnedAwayError("503 Service Unavailable", "cannot serve more clients; try again later")
            self._let_in(handshake.answer(self._head[:end], self._hall.config.origin), self._head[end + len(handshake.END) :])
        except TurnedAwayError as error:
            self._turn_away(error)
        except Refused as error:
            self._turn_away(TurnedAwayError("401 Unauthorized", str(error)))

    def _let_in(self, accepted: handshake.Accepted, rest: bytes) -> None:
        gate = self._hall.gate
        access = None if accepted.token is None or gate.is_open else gate.by_token(accepted.token)
        self._timer.cancel()
        self._transport.write(accepted.response)
        connection = Connection(self._hall, self._transport, access)
        self._transport.set_protocol(connection)
        if rest:
            connection.data_received(rest)

    def _is_late(self) -> None:
        self._turn_away(TurnedAwayError("408 Request Timeout", "cannot wait longer for the request"))

    def _turn_away(self, error: TurnedAwayError) -> None:
        self._timer.cancel()
        self._timer = asyncio.get_running_loop().call_later(MOMENT, self._transport.abort)
        self._transport.write(error.response)
        self._transport.close()
        self._head = b""


class Porch(asyncio.Protocol):
    """A connection on which TLS is to be spoken first: it counts as any other, and has a bounded time for its handshake."""

    def __init__(self, hall: Hall, tls: ssl.SSLContext) -> None:
        self._hall = hall
        self._tls = tls

    def connection_made(self, transport: Any) -> None:
        """A client has connected; nothing of it has been read yet, so that its socket can be given to TLS."""
        knock = transport.get_extra_info("socket").dup()
        transport.abort()
        self._hall.knocking.add(knock)
        if self._hall.excess > CROWD:
            self._forget(knock)
        else:
            self._hall.work(self._shake_hands(knock))

    async def _shake_hands(self, knock: socket.socket) -> None:
        seconds = _patience(self._hall)
        try:
            await asyncio.get_running_loop().connect_accepted_socket(
                lambda: Doorway(self._hall, knock), knock, ssl=self._tls, ssl_handshake_timeout=seconds
            )
        except OSError:  # it speaks no TLS that we speak, or not in time
            self._forget(knock)

    def _forget(self, knock: socket.socket) -> None:
        self._hall.knocking.discard(knock)
        knock.close()


def _patience(hall: Hall) -> float:
    """Seconds that a connection has to enter."""
    return min(hall.config.entry_timeout, MOMENT) if hall.excess > 0 else hall.config.entry_timeout
