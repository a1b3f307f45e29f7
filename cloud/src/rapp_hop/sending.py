"""Answers onto a transport: head and body in one write, files and streams in pieces, never faster than the peer reads."""

import asyncio
import functools
import logging
import time
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing
from email.utils import formatdate
from http import HTTPStatus
from pathlib import Path
from typing import BinaryIO

from rapp_hop.protocol import WireAnswer

PIECE = 256 * 1024  # bytes
_REASONS = {status.value: status.phrase for status in HTTPStatus}
_log = logging.getLogger(__name__)


class Sender:
    """The writing half of one connection."""

    def __init__(self, transport: asyncio.Transport, loop: asyncio.AbstractEventLoop) -> None:
        self._transport = transport
        self._loop = loop
        self._full: asyncio.Future[None] | None = None
        self._gone = False

    @property
    def free(self) -> bool:
        """Whether the peer takes what is sent."""
        return self._full is None

    def pause(self) -> None:
        """The peer does not keep up."""
        if self._full is None:
            self._full = self._loop.create_future()

    def resume(self) -> None:
        """It does again."""
        full, self._full = self._full, None
        if full is not None and not full.done():
            full.set_result(None)

    def lost(self) -> None:
        """Nobody is there."""
        self._gone = True
        self.resume()

    async def send(self, answer: WireAnswer, keep: bool, without_body: bool, version: str, waiting: Callable[[bool], None]) -> None:
        """Send one answer.

        :param waiting: told when it begins and ends to wait for the peer
        """
        if isinstance(answer.body, bytes):
            head = head_of(answer, keep, len(answer.body))
            self._transport.write(head if without_body else head + answer.body)
            await self._drain(waiting)
        elif isinstance(answer.body, Path):
            await self._send_file(answer, answer.body, keep, without_body, waiting)
        else:
            await self._send_stream(answer, answer.body, keep, without_body, version, waiting)

    async def _drain(self, waiting: Callable[[bool], None]) -> None:
        if self._full is not None and not self._gone:
            waiting(True)
            await self._full
            waiting(False)

    async def _send_file(
        self, answer: WireAnswer, path: Path, keep: bool, without_body: bool, waiting: Callable[[bool], None]
    ) -> None:
        file, size = await asyncio.to_thread(_open, path)
        with file:
            self._transport.write(head_of(answer, keep, size))
            while size and not self._gone and not without_body:
                piece = await asyncio.to_thread(file.read, min(size, PIECE))
                if not piece:
                    _log.error("a file of an answer became shorter while it was sent")
                    self._transport.abort()
                    return
                size -= len(piece)
                self._transport.write(piece)
                await self._drain(waiting)

    async def _send_stream(
        self, answer: WireAnswer, pieces: AsyncGenerator[bytes, None], keep: bool, without_body: bool, version: str,
        waiting: Callable[[bool], None],
    ) -> None:  # fmt: skip
        chunked = version == "1.1"
        self._transport.write(head_of(answer, keep and chunked, None if chunked else -1))
        try:
            async with aclosing(pieces):
                async for piece in pieces:
                    if self._gone or without_body:
                        return
                    if piece:
                        self._transport.write(b"%x\r\n%b\r\n" % (len(piece), piece) if chunked else piece)
                        await self._drain(waiting)
        except Exception:  # noqa: BLE001 (the service's own, of any kind)
            _log.exception("a stream of an answer broke off")
            self._transport.abort()
            return
        self._transport.write(b"0\r\n\r\n" if chunked else b"")
        if not chunked:
            self._transport.close()


def _open(path: Path) -> tuple[BinaryIO, int]:
    file = path.open("rb")
    return file, path.stat().st_size


_FIXED = b"Server: rapp\r\nX-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\n"


def head_of(answer: WireAnswer, keep: bool, length: int | None) -> bytes:
    """Return status line and headers.

    :param length: of the body; None when it goes in chunks, below zero when the connection's end ends it
    :raises ValueError: when a header holds a line end
    """
    lines = [f"HTTP/1.1 {answer.status} {_REASONS.get(answer.status, 'Error')}", f"Content-Type: {answer.content_type}"]
    lines += [f"{name}: {value}" for name, value in answer.headers]
    if length is None:
        lines.append("Transfer-Encoding: chunked")
    elif length >= 0:
        lines.append(f"Content-Length: {length}")
    if not keep:
        lines.append("Connection: close")
    text = "\r\n".join(lines)
    if text.count("\n") != len(lines) - 1 or text.count("\r") != len(lines) - 1:
        raise ValueError("cannot send a header that holds a line end")
    return text.encode("latin-1", "replace") + b"\r\nDate: " + _date(int(time.time())) + b"\r\n" + _FIXED + b"\r\n"


@functools.lru_cache(maxsize=2)
def _date(second: int) -> bytes:
    return formatdate(second, usegmt=True).encode()
