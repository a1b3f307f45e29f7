"""The way from link to platform, with faults: answers that are slow, cut, too long, no JSON, HTTP 500, changed, somebody else's.

The platform behind it is the real one. A fault belongs to paths that begin with a prefix, and lasts until it is taken away.
"""

import asyncio
import threading
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

from fakes.line import LOOPBACK, MOST, PATIENCE, Line, Pair


@dataclass(frozen=True)
class Answer:
    """What the platform has answered."""

    head: bytes  # with the empty line
    body: bytes

    @property
    def whole(self) -> bytes:
        return self.head + self.body


Fault = Callable[[asyncio.StreamWriter, str, Answer], Awaitable[None]]


def answer(status: str, body: bytes, length: int | None = None) -> bytes:
    size = len(body) if length is None else length
    return f"HTTP/1.1 {status}\r\nContent-Type: text/html\r\nContent-Length: {size}\r\n\r\n".encode() + body


async def silent(writer: asyncio.StreamWriter, _path: str, _answer: Answer) -> None:
    """Nothing comes until the line is cut."""
    await _for_ever(writer)


async def half(writer: asyncio.StreamWriter, _path: str, real: Answer) -> None:
    """Half of the body comes, then nothing until the line is cut."""
    await _write(writer, real.head + real.body[: len(real.body) // 2])
    await _for_ever(writer)


async def cut(writer: asyncio.StreamWriter, _path: str, real: Answer) -> None:
    """The connection ends in the middle of the body."""
    await _write(writer, real.head + real.body[: len(real.body) // 2])


async def slow(writer: asyncio.StreamWriter, _path: str, real: Answer) -> None:
    """It trickles: a byte every half second."""
    for place in range(len(real.whole)):
        await _write(writer, real.whole[place : place + 1])
        await asyncio.sleep(0.5)


async def too_long(writer: asyncio.StreamWriter, _path: str, _answer: Answer) -> None:
    """A body without end."""
    await _write(writer, b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n\r\n")
    while True:
        await _write(writer, b" " * 2**16)


async def no_json(writer: asyncio.StreamWriter, _path: str, _answer: Answer) -> None:
    """A page for people, as from a hotel's network."""
    await _write(writer, answer("200 OK", b"<html><body>Welcome! Please log in.</body></html>"))


async def error_500(writer: asyncio.StreamWriter, _path: str, _answer: Answer) -> None:
    """The platform has broken down."""
    await _write(writer, answer("500 Internal Server Error", b"<h1>Internal Server Error</h1>"))


async def changed(writer: asyncio.StreamWriter, _path: str, real: Answer) -> None:
    """One bit of the body is another."""
    body = bytearray(real.body)
    body[len(body) // 2] ^= 1
    await _write(writer, real.head + bytes(body))


def out_of(folder: Path, prefix: str) -> Fault:
    """Somebody else's files in place of the platform's."""

    async def other(writer: asyncio.StreamWriter, path: str, _answer: Answer) -> None:
        file = folder / path.removeprefix(prefix)
        known = file.is_file()
        await _write(writer, answer("200 OK", file.read_bytes()) if known else answer("404 Not Found", b""))

    return other


class FaultyCloud(Line):
    """Set faults with `set`; `reached` is set when one has begun."""

    def __init__(self, beyond: int) -> None:
        self._faults: dict[str, Fault] = {}
        self.reached = threading.Event()
        self.asked: list[str] = []
        super().__init__(beyond)

    @property
    def url(self) -> str:
        return f"http://{LOOPBACK}:{self.port}"

    def set(self, prefix: str, fault: Fault) -> None:
        """From now on answers to paths that begin with `prefix` have this fault."""
        self.reached.clear()
        self._faults[prefix] = fault

    def mend(self) -> None:
        """No faults any more; what a fault holds up is cut."""
        self._faults.clear()
        self.cut()
        self.back()

    def wait_reached(self) -> None:
        assert self.reached.wait(PATIENCE), f"no request met a fault of {list(self._faults)}; asked: {self.asked}"

    async def relay(self, client: Pair) -> None:
        reader, writer = client
        head = await reader.readuntil(b"\r\n\r\n")
        path = head.split()[1].decode()
        size = next((int(line.split(b":")[1]) for line in head.splitlines() if line.lower().startswith(b"content-length:")), 0)
        body = await reader.readexactly(size)
        self.asked.append(path)
        real = await self._ask(head + body)
        fault = next((fault for prefix, fault in self._faults.items() if path.startswith(prefix)), None)
        if fault is None:
            await _write(writer, real.whole)
            return
        self.reached.set()
        await fault(writer, path, real)

    async def _ask(self, request: bytes) -> Answer:
        """The platform's answer; the link's client asks for one answer a connection."""
        reader, writer = await asyncio.open_connection(LOOPBACK, self.beyond, limit=MOST)
        try:
            await _write(writer, request)
            head, _, body = (await reader.read(-1)).partition(b"\r\n\r\n")
        finally:
            writer.close()
        return Answer(head + b"\r\n\r\n", body)


async def _write(writer: asyncio.StreamWriter, data: bytes) -> None:
    writer.write(data)
    await writer.drain()


async def _for_ever(writer: asyncio.StreamWriter) -> None:
    await writer.drain()
    await asyncio.Event().wait()
