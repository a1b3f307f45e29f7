"""Parts of files onto lines of the kernel's: all of it, in order, or the reason; and no descriptor is left."""

import asyncio
import errno
import os
import random
import socket
from collections.abc import Awaitable, Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from tornado.iostream import BaseIOStream, IOStream, PipeIOStream, StreamClosedError

from rapp_hop.file_sending import TooShortError, send_file
from rapp_hop.protocol import OpenFile, WireAnswer
from rapp_hop.sending import send

SIZE = 20 * 2**20 + 1  # bytes: more than a line holds, and than is looked for in memory at once
PATIENCE = 30.0  # s

Read = Callable[[int], Awaitable[bytes]]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sent") / "file"
    path.write_bytes(random.Random(1).randbytes(SIZE))
    return path


@pytest.fixture(autouse=True)
def no_descriptor_is_left() -> Iterator[None]:
    before = len(list(Path("/proc/self/fd").iterdir()))
    yield
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def over(kind: str, test: Callable[[BaseIOStream, int], Awaitable[None]]) -> None:
    """Run a test with a stream, and the descriptor where it comes out."""

    async def main() -> None:
        if kind == "socket":
            near, far = socket.socketpair()
            stream: BaseIOStream = IOStream(near)
            end = far.detach()
        else:
            end, start = os.pipe()
            stream = PipeIOStream(start)
        try:
            async with asyncio.timeout(60):
                await test(stream, end)
        finally:
            stream.close()
            os.close(end)

    asyncio.run(main())


def read_all(end: int, count: int) -> bytes:
    found = bytearray()
    while len(found) < count:
        piece = os.read(end, min(2**20, count - len(found)))
        assert piece, "the line ended early"
        found += piece
    return bytes(found)


def read_to_the_end(end: int) -> int:
    count = 0
    while piece := os.read(end, 2**20):
        count += len(piece)
    return count


@pytest.mark.parametrize("kind", ["socket", "pipe"])
@pytest.mark.parametrize(("start", "length"), [(0, SIZE), (SIZE - 5, 5), (4097, 3 * 2**20), (7, 0)])
def test_a_part_of_a_file(kind: str, start: int, length: int, file: Path) -> None:
    async def test(stream: BaseIOStream, end: int) -> None:
        with file.open("rb") as opened:
            got = asyncio.create_task(asyncio.to_thread(read_all, end, length))
            await send_file(stream, OpenFile(opened, start, length), PATIENCE)
            assert await got == file.read_bytes()[start : start + length]

    over(kind, test)


@pytest.mark.parametrize("kind", ["socket", "pipe"])
def test_what_the_system_does_not_hold_in_memory_comes_from_the_disk(kind: str, file: Path) -> None:
    async def test(stream: BaseIOStream, end: int) -> None:
        with file.open("rb") as opened:
            os.fsync(opened.fileno())
            os.posix_fadvise(opened.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
            got = asyncio.create_task(asyncio.to_thread(read_all, end, SIZE))
            await send_file(stream, OpenFile(opened, 0, SIZE), PATIENCE)
            assert await got == file.read_bytes()

    over(kind, test)


@pytest.mark.parametrize("kind", ["socket", "pipe"])
def test_a_peer_that_takes_nothing_is_not_waited_for(kind: str, file: Path) -> None:
    async def test(stream: BaseIOStream, end: int) -> None:
        with file.open("rb") as opened, pytest.raises(TimeoutError):
            await send_file(stream, OpenFile(opened, 0, SIZE), 0.05)

    over(kind, test)


def test_a_peer_that_has_gone(file: Path) -> None:
    async def test(stream: BaseIOStream, end: int) -> None:
        with file.open("rb") as opened, closing(socket.socket(fileno=os.dup(end))) as far:
            sending = asyncio.create_task(send_file(stream, OpenFile(opened, 0, SIZE), PATIENCE))
            await asyncio.to_thread(read_all, end, 100_000)
            far.shutdown(socket.SHUT_RDWR)
            with pytest.raises(StreamClosedError):
                await sending

    over("socket", test)


def test_a_stream_that_is_closed_meanwhile(file: Path) -> None:
    async def test(stream: BaseIOStream, end: int) -> None:
        stream.close()
        with file.open("rb") as opened, pytest.raises(StreamClosedError):
            await send_file(stream, OpenFile(opened, 0, SIZE), PATIENCE)

    over("socket", test)


def failing(number: int, good: int = 0) -> Callable[..., int]:
    """A sendfile that fails after some good calls."""
    sendfile, calls = os.sendfile, iter(range(good))

    def send(*arguments: int) -> int:
        if next(calls, None) is None:
            raise OSError(number, os.strerror(number))
        return sendfile(*arguments)

    return send


@pytest.mark.parametrize("number", [errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_that_the_kernel_does_not_send_goes_in_pieces(file: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    async def test(stream: BaseIOStream, end: int) -> None:
        monkeypatch.setattr(os, "sendfile", failing(number))
        with file.open("rb") as opened:
            got = asyncio.create_task(asyncio.to_thread(read_all, end, 2**20))
            await send_file(stream, OpenFile(opened, 5, 2**20), PATIENCE)
            assert await got == file.read_bytes()[5 : 5 + 2**20]

    over("socket", test)


@pytest.mark.parametrize(("number", "good"), [(errno.EIO, 0), (errno.EIO, 1), (errno.EINVAL, 1)])
def test_a_file_that_cannot_be_read_further_is_said_and_ends_the_connection(
    file: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, number: int, good: int
) -> None:
    async def test(stream: BaseIOStream, end: int) -> None:
        monkeypatch.setattr(os, "sendfile", failing(number, good))
        reading = asyncio.create_task(asyncio.to_thread(read_to_the_end, end))
        await send(stream, WireAnswer(200, "text/plain", OpenFile(file.open("rb"), 0, SIZE)), True, False, "1.1", PATIENCE)
        assert stream.closed()
        assert await reading < SIZE

    over("socket", test)
    assert [record.getMessage() for record in caplog.records] == [f"a file of an answer cannot be read: {os.strerror(number)}"]


@pytest.mark.parametrize("number", [errno.EPIPE, errno.ECONNRESET, errno.ETIMEDOUT])
def test_a_peer_that_goes_is_no_fault_of_the_file(
    file: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, number: int
) -> None:
    async def test(stream: BaseIOStream, end: int) -> None:
        monkeypatch.setattr(os, "sendfile", failing(number))
        await send(stream, WireAnswer(200, "text/plain", OpenFile(file.open("rb"), 0, SIZE)), True, False, "1.1", PATIENCE)
        assert stream.closed()

    over("socket", test)
    assert not caplog.records


@pytest.mark.parametrize("kind", ["socket", "pipe"])
def test_a_file_that_became_shorter(kind: str, file: Path) -> None:
    async def test(stream: BaseIOStream, end: int) -> None:
        with file.open("rb") as opened, pytest.raises(TooShortError):
            await send_file(stream, OpenFile(opened, SIZE - 5, 10), PATIENCE)

    over(kind, test)
