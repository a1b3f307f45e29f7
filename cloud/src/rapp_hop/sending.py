"""Answers onto a connection: head and body in one write, files and streams in pieces, never faster than the peer reads."""

import asyncio
import functools
import logging
import os
import time
from collections.abc import AsyncGenerator
from contextlib import aclosing
from email.utils import formatdate
from http import HTTPStatus
from pathlib import Path

from tornado.iostream import BaseIOStream, StreamClosedError

from rapp_hop.file_sending import TooShortError, send_file
from rapp_hop.protocol import OpenFile, WireAnswer

_REASONS = {status.value: status.phrase for status in HTTPStatus}
_FIXED = b"Server: rapp\r\nX-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\n"
_log = logging.getLogger(__name__)


async def send(stream: BaseIOStream, answer: WireAnswer, keep: bool, without_body: bool, version: str, patience: float) -> None:
    """Send one answer; a connection that is not as it should be afterwards is closed.

    :param version: of HTTP, 1.0 knows no chunks
    :param patience: seconds in which the peer may take nothing
    """
    try:
        if isinstance(answer.body, bytes):
            head = head_of(answer, keep, len(answer.body), version)
            await _put(stream, head if without_body else head + answer.body, patience)
        elif isinstance(answer.body, Path | OpenFile):
            await _send_file(stream, answer, answer.body, keep, without_body, version, patience)
        else:
            await _send_stream(stream, answer, answer.body, keep, without_body, version, patience)
    except (StreamClosedError, TimeoutError):
        stream.close()


async def _put(stream: BaseIOStream, data: bytes, patience: float) -> None:
    written = stream.write(data)
    if not written.done():
        async with asyncio.timeout(patience):
            await written


async def _send_file(
    stream: BaseIOStream, answer: WireAnswer, body: Path | OpenFile, keep: bool, without_body: bool, version: str, patience: float
) -> None:
    part = await asyncio.to_thread(_open, body) if isinstance(body, Path) else body
    with part.file:
        await _put(stream, head_of(answer, keep, part.length, version), patience)
        if without_body:
            return
        try:
            await send_file(stream, part, patience)
        except TooShortError:
            _log.error("a file of an answer became shorter while it was sent")
            stream.close()
        except (StreamClosedError, TimeoutError):
            raise
        except OSError as error:
            _log.error("a file of an answer cannot be read: %s", error.strerror)
            stream.close()


async def _send_stream(
    stream: BaseIOStream, answer: WireAnswer, pieces: AsyncGenerator[bytes, None], keep: bool, without_body: bool,
    version: str, patience: float,
) -> None:  # fmt: skip
    chunked = version != "1.0"
    await _put(stream, head_of(answer, keep and chunked, None if chunked else -1, version), patience)
    async with aclosing(pieces):
        try:
            async for piece in pieces:
                if piece and not without_body:
                    await _put(stream, b"%x\r\n%b\r\n" % (len(piece), piece) if chunked else piece, patience)
        except (StreamClosedError, TimeoutError):
            raise
        except Exception:  # noqa: BLE001 (the service's own, of any kind)
            _log.exception("a stream of an answer broke off")
            stream.close()
            return
    if chunked:
        await _put(stream, b"0\r\n\r\n", patience)
    else:
        stream.close()


def head_of(answer: WireAnswer, keep: bool, length: int | None, version: str = "1.1") -> bytes:
    """Return status line and headers.

    :param length: of the body; None when it goes in chunks, below zero when the connection's end ends it
    :raises ValueError: when a header holds a line end
    """
    if not answer.headers and length is not None and length >= 0:
        start = _plain_head(answer.status, answer.content_type, keep, version)
        return start + b"Content-Length: %d\r\nDate: %b\r\n\r\n" % (length, _date(int(time.time())))
    lines = [f"{name}: {value}" for name, value in answer.headers]
    if length is None:
        lines.append("Transfer-Encoding: chunked")
    elif length >= 0:
        lines.append(f"Content-Length: {length}")
    start = _plain_head(answer.status, answer.content_type, keep, version)
    return start + _encoded(lines) + b"Date: %b\r\n\r\n" % _date(int(time.time()))


@functools.lru_cache(maxsize=256)
def _plain_head(status: int, content_type: str, keep: bool, version: str) -> bytes:
    lines = [f"HTTP/1.1 {status} {_REASONS.get(status, 'Error')}", f"Content-Type: {content_type}"]
    if not keep:
        lines.append("Connection: close")
    elif version == "1.0":
        lines.append("Connection: keep-alive")
    return _encoded(lines) + _FIXED


def _encoded(lines: list[str]) -> bytes:
    text = "".join(f"{line}\r\n" for line in lines)
    if text.count("\n") != len(lines) or text.count("\r") != len(lines):
        raise ValueError("cannot send a header that holds a line end")
    return text.encode("latin-1", "replace")


@functools.lru_cache(maxsize=2)
def _date(second: int) -> bytes:
    return formatdate(second, usegmt=True).encode()


def _open(path: Path) -> OpenFile:
    file = path.open("rb")
    return OpenFile(file, 0, os.fstat(file.fileno()).st_size)
