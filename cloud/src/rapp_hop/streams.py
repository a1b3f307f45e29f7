"""Connections that stay open for the answer when the peer has closed its sending half, as Hop's native clients do at once.

Tornado takes the end of what comes for a gone client. Here it counts only when somebody reads: while an answer is due, it is
kept in mind, and the next read finds it. What Tornado ends without a word, or with a bare status line, is told the reason.
"""

import asyncio
import contextlib
import socket
import ssl
from collections.abc import Callable
from typing import Any

from tornado.ioloop import IOLoop
from tornado.iostream import IOStream, SSLIOStream, UnsatisfiableReadError

BARE_400 = b"HTTP/1.1 400 Bad Request\r\n\r\n"
"""What Tornado writes for a request that is none."""

DRAIN = 2**20  # bytes thrown away at most, so that the peer can read the answer before the connection's end


class _Patient:
    """See the module; put before a stream class of Tornado."""

    malformed: bytes = BARE_400  # the answer for what is no request
    too_long: bytes = b""  # the answer for headers without end
    began: float | None = None  # when the first byte of a request came that is expected
    expecting = False  # a request
    _state: int | None  # Tornado's: what it listens for
    _read_buffer_size: int  # Tornado's
    on_closed: Callable[[], None] | None = None

    def read_from_fd(self, buf: bytearray | memoryview) -> int | None:
        """Read; the end is none while nobody reads."""
        count: int | None = super().read_from_fd(buf)  # type: ignore[misc]
        if count == 0 and not self.reading():  # type: ignore[attr-defined]
            # The kernel would tell of the end again and again: listen no more until somebody reads.
            self.io_loop.add_callback(self._deaf)  # type: ignore[attr-defined]
            return None
        if count and self.expecting and self.began is None:
            self.began = asyncio.get_running_loop().time()
        return count

    def expect(self, now: float) -> None:
        """Expect a request; some of it may have come already, behind the one before."""
        self.expecting, self.began = True, now if self._read_buffer_size else None

    def write(self, data: bytes | memoryview) -> "asyncio.Future[None]":
        """Write, the whole answer where Tornado has only its first line."""
        future: asyncio.Future[None] = super().write(self.malformed if data == BARE_400 else data)  # type: ignore[misc]
        return future

    def finish_writing(self) -> None:
        """Tell the peer that nothing more comes; what he sends can still be read."""
        with contextlib.suppress(OSError):  # he has gone
            _finish_writing(self.socket)  # type: ignore[attr-defined]

    def close(self, exc_info: Any = False) -> None:
        """Close, so that the peer can read what was last written."""
        line: socket.socket | None = self.socket  # type: ignore[attr-defined]
        if line is not None and not self.closed():  # type: ignore[attr-defined]
            _farewell(line, self.too_long if isinstance(exc_info, UnsatisfiableReadError) else b"")
            if self.on_closed is not None:
                self.on_closed()
        super().close(exc_info)  # type: ignore[misc]

    def _deaf(self) -> None:
        if not self.closed() and not self.reading() and self._state is not None:  # type: ignore[attr-defined]
            self._state = IOLoop.ERROR | (self._state & IOLoop.WRITE)
            self.io_loop.update_handler(self.fileno(), self._state)  # type: ignore[attr-defined]


class PatientStream(_Patient, IOStream):
    """A plain connection."""


class PatientTlsStream(_Patient, SSLIOStream):
    """A connection with TLS."""


def _farewell(line: socket.socket, last: bytes) -> None:
    try:
        if last and not isinstance(line, ssl.SSLSocket):
            line.send(last)
        _finish_writing(line)
        for _ in range(DRAIN // 65536):
            if not socket.socket.recv(line, 65536):
                return
    except OSError:  # nothing more to read, or nobody there
        return


def _finish_writing(line: socket.socket) -> None:
    socket.socket.shutdown(line, socket.SHUT_WR)  # TLS's own would forget how to read
