"""HOP's client: what servers may send it, and to whom it shows its token."""

import asyncio
import gc
import socket
import threading
from pathlib import Path
from typing import Any

import pytest

from fakes.echoing import TOKEN, failure
from rapp_hop import client as client_module
from rapp_hop import connecting
from rapp_hop.client import HopClient
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable


class Line:
    """A server of one connection at a time that answers with given bytes."""

    def __init__(self, *pieces: bytes, endless: bytes = b"", pause: float = 0.0) -> None:
        self._pieces, self._endless, self._pause = pieces, endless, pause

    async def __aenter__(self) -> str:
        self._server = await asyncio.start_server(self._answer, "127.0.0.1", 0)
        return f"http://127.0.0.1:{self._server.sockets[0].getsockname()[1]}"

    async def __aexit__(self, *_: object) -> None:
        self._server.close()
        await self._server.wait_closed()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            await reader.readuntil(b"\r\n\r\n")
            for piece in self._pieces:
                writer.write(piece)
                await writer.drain()
            while self._endless:
                writer.write(self._endless)
                await writer.drain()
                await asyncio.sleep(self._pause)
        except ConnectionError:
            pass
        finally:
            writer.close()


CHUNKED = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"
CHUNK = b"1000\r\n" + bytes(4096) + b"\r\n"


@pytest.mark.parametrize(
    ("line", "leaf"),
    [
        (Line(CHUNKED, endless=CHUNK), Invalid),  # S09
        (Line(b"HTTP/1.1 200 OK\r\nContent-Length: 999999999\r\n\r\n"), Invalid),
        (Line(b"HTTP/1.1 200 OK\r\n\r\n", endless=bytes(4096)), Invalid),
        (Line(b"HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nhalf"), Unreachable),  # S11
        (Line(CHUNKED, CHUNK), Unreachable),
        (Line(b"HTTP/1.1 404 No\r\nContent-Length: 0\r\n\r\n"), Refused),
        (Line(b"HTTP/1.1 302 Go\r\nLocation: http://127.0.0.1:1/\r\nContent-Length: 0\r\n\r\n"), Refused),  # S16
        (Line(b"HTTP/1.1 503 No\r\nContent-Length: 0\r\n\r\n"), Unreachable),
        (Line(b"rubbish\r\n\r\n"), Unreachable),
    ],
)  # fmt: skip
def test_downloads_are_bounded(tmp_path: Path, line: Line, leaf: type[HopError]) -> None:
    async def main() -> None:
        async with line as url:
            client = HopClient(url, TOKEN)
            error = await failure(client.download("/x", tmp_path / "x", 10_000, timeout=20))
            assert type(error) is leaf
            assert not (tmp_path / "x").exists() or (tmp_path / "x").stat().st_size <= 10_000

    asyncio.run(main())


def test_s10_a_trickling_download_ends_in_time(tmp_path: Path) -> None:
    async def main() -> None:
        async with Line(b"HTTP/1.1 200 OK\r\nContent-Length: 9000\r\n\r\n", endless=b"x", pause=0.02) as url:
            error = await failure(HopClient(url).download("/x", tmp_path / "x", 10_000, timeout=0.5))
            assert isinstance(error, Unreachable)
        async with Line(b"HTTP/1.1 200 OK\r\n", endless=b"X: " + b"y" * 5000 + b"\r\n") as url:
            error = await failure(HopClient(url).download("/x", tmp_path / "x", 10_000, timeout=20))
            assert isinstance(error, Invalid)

    asyncio.run(main())


def test_a_download_of_which_nothing_comes_ends_before_its_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rapp_hop.client.IDLE", 0.5)

    async def main() -> None:
        half = b"HTTP/1.1 200 OK\r\nContent-Length: 9000\r\n\r\nhalf"
        async with Line(half, endless=b"x", pause=1000) as url, asyncio.timeout(20):
            error = await failure(HopClient(url).download("/x", tmp_path / "x", 10_000, timeout=1000))
            assert isinstance(error, Unreachable)
        slow = Line(b"HTTP/1.1 200 OK\r\nContent-Length: 8\r\n\r\n", endless=b"x", pause=0.1)
        async with slow as url:
            assert await HopClient(url).download("/x", tmp_path / "x", 10_000, timeout=1000) == 8

    asyncio.run(main())


def test_a_download_tells_its_progress_and_a_full_disk(tmp_path: Path) -> None:
    async def main() -> None:
        told: list[tuple[int, int | None]] = []
        async with Line(b"HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhello") as url:
            client = HopClient(url)
            assert await client.download("/x", tmp_path / "x", 5, on_progress=lambda *all_: told.append(all_)) == 5
            assert (tmp_path / "x").read_bytes() == b"hello"
            assert told[-1] == (5, 5)
            with Path("/dev/full").open("wb", buffering=0) as full, pytest.raises(OSError, match="No space"):
                await client.download("/x", full.write, 5)

    asyncio.run(main())


def test_the_token_goes_to_its_own_platform_only(tmp_path: Path) -> None:
    async def main() -> None:
        seen: list[bytes] = []

        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            seen.append(await reader.readuntil(b"\r\n\r\n"))
            writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{}")
            await writer.drain()
            writer.close()

        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        async with server:
            port = server.sockets[0].getsockname()[1]
            own, foreign = HopClient(f"http://127.0.0.1:{port}", TOKEN), HopClient("http://127.0.0.1:1", TOKEN)
            await own.call("x")
            done: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
            foreign.with_url(f"http://127.0.0.1:{port}/hop/x", {}, done.set_result, done.set_exception)
            await done
        assert [TOKEN.encode() in head_ for head_ in seen] == [True, False]

    asyncio.run(main())


def test_an_answer_that_is_not_json_or_too_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def main() -> None:
        for answer in (b"<html>", b'{"a":NaN}', b""):
            async with Line(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(answer) + answer) as url:
                assert isinstance(await failure(HopClient(url).call("x")), Invalid)
        async with Line(b"HTTP/1.1 500 Oh\r\nContent-Length: 6\r\n\r\n<html>") as url:
            assert isinstance(await failure(HopClient(url).call("x")), Bug)
        monkeypatch.setattr(client_module, "MAX_ANSWER", 1000)
        async with Line(b"HTTP/1.1 200 OK\r\nContent-Length: 2000\r\n\r\n", b" " * 2000) as url:
            assert isinstance(await failure(HopClient(url).call("x")), Unreachable | Invalid)

    asyncio.run(main())


def test_a_name_server_that_is_away_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """The system's resolver goes on for long after we have given up, then fails: nobody is troubled with that."""
    back, went = threading.Event(), threading.Event()

    def resolve(*_: object, **__: object) -> None:
        back.wait(20)
        went.set()
        raise socket.gaierror(socket.EAI_AGAIN, "Temporary failure in name resolution")

    monkeypatch.setattr(socket, "getaddrinfo", resolve)
    monkeypatch.setattr(connecting, "NAME_TIMEOUT", 0.05)

    async def call() -> None:
        error = await failure(HopClient("http://platform.test").call("echo", {}, timeout=10))
        assert isinstance(error, Unreachable)
        assert "no name server answers, try again later" in str(error)
        back.set()
        await asyncio.to_thread(went.wait, 20)

    asyncio.run(call())
    gc.collect()
    assert caplog.records == []
