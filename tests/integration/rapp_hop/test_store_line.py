"""S16 to S18, and S09 to S11 on a real line: faulty servers, cut connections, disks that are full or read-only.

Whatever happens, the old version is still there and nothing else is.
"""

import asyncio
import json
import os
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from fakes.packages import source_folder
from rapp_cloud.shelf import Shelf
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Unreachable
from rapp_hop.hz.archive import build
from rapp_hop.hz.delivery import Delivery, DeliveryLimits
from rapp_hop.hz.trust import Attack, Untrusted

Answer = Callable[[asyncio.StreamWriter, str, bytes | None], Awaitable[None]]  # to a path, with the store's file
SCRIPT = Path(__file__).with_name("full_disk.py")
SIZE = 700_000  # bytes of what the new version brings


@pytest.fixture
def store(tmp_path: Path) -> Path:
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    shelf.create()
    shelf.publish(build(source_folder(tmp_path, version="1.0.0", program="old\n")))
    return tmp_path / "tuf"


def publish_new(store: Path) -> None:
    source = source_folder(store.parent / "new", version="1.1.0", program="new\n")
    (source / "sound.bin").write_bytes(os.urandom(SIZE))
    Shelf(store, store.parent / "keys").publish(build(source))


async def right(writer: asyncio.StreamWriter, _path: str, file: bytes | None) -> None:
    body = file or b""
    writer.write(f"HTTP/1.1 {200 if file else 404} X\r\nContent-Length: {len(body)}\r\n\r\n".encode() + body)


class Server:
    """Serves a store's folder; `answer` may do worse."""

    def __init__(self, store: Path) -> None:
        self._store = store
        self.answer: Answer = right
        self.asked: list[str] = []

    async def open(self) -> int:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        return int(self._server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        self._server.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        path = (await reader.readuntil(b"\r\n\r\n")).split()[1].decode()
        self.asked.append(path)
        file = self._store / path.removeprefix("/tuf/")
        try:
            await self.answer(writer, path, file.read_bytes() if file.is_file() else None)
            await writer.drain()
        except ConnectionError:
            pass
        finally:
            writer.close()


def refused(store: Path, answer: Answer, *, home: Path, limits: DeliveryLimits | None = None) -> HopError:
    """Install 1.0.0, then try to update while `answer` answers; afterwards the update works."""

    async def main() -> HopError:
        server = Server(store)
        client = HopClient(f"http://127.0.0.1:{await server.open()}")
        try:
            delivery = Delivery(client, (store / "metadata/1.root.json").read_bytes(), home, limits)
            assert (await delivery.install("hello")).version == "1.0.0"
            publish_new(store)
            server.answer = answer
            with pytest.raises(HopError) as caught:
                await delivery.install("hello")
            there = delivery.folder.find("hello")
            assert there is not None and (there.version, (there.path / "agent.py").read_text()) == ("1.0.0", "old\n")
            left = {path.suffix for path in (home / "downloads").iterdir()}
            assert left <= ({".part"} if isinstance(caught.value, Unreachable) else set())
            server.answer = right
            assert (await delivery.install("hello")).version == "1.1.0"
            assert list((home / "downloads").iterdir()) == []
            return caught.value
        finally:
            await client.close()
            await server.close()

    return asyncio.run(main())


@pytest.mark.parametrize("where", ["/metadata/", "/targets/"])
@pytest.mark.parametrize("status", ["500 Internal Server Error", "503 Service Unavailable"])
def test_s16_server_errors(store: Path, tmp_path: Path, status: str, where: str) -> None:
    async def answer(writer: asyncio.StreamWriter, path: str, file: bytes | None) -> None:
        if where in path:
            writer.write(f"HTTP/1.1 {status}\r\nContent-Length: 0\r\n\r\n".encode())
        else:
            await right(writer, path, file)

    assert isinstance(refused(store, answer, home=tmp_path / "robot"), Unreachable)


@pytest.mark.parametrize("where", ["/metadata/timestamp", "/metadata/", "/targets/"])
def test_s16_redirects_are_not_followed(store: Path, tmp_path: Path, where: str) -> None:
    other: list[str] = []

    async def elsewhere(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        other.append((await reader.readline()).decode())
        writer.close()

    async def answer(writer: asyncio.StreamWriter, path: str, file: bytes | None) -> None:
        if where not in path:
            await right(writer, path, file)
            return
        server = await asyncio.start_server(elsewhere, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        goal = path if where == "/metadata/timestamp" else f"http://127.0.0.1:{port}{path}"  # a loop, or another host
        writer.write(f"HTTP/1.1 302 Found\r\nLocation: {goal}\r\nContent-Length: 0\r\n\r\n".encode())
        await writer.drain()
        server.close()

    assert isinstance(refused(store, answer, home=tmp_path / "robot"), Unreachable)
    assert other == []


def test_s16_nobody_there(store: Path, tmp_path: Path) -> None:
    async def main() -> None:
        server = Server(store)
        port = await server.open()
        await server.close()
        client = HopClient(f"http://127.0.0.1:{port}")
        with pytest.raises(Unreachable, match="try again later"):
            await Delivery(client, (store / "metadata/1.root.json").read_bytes(), tmp_path / "robot").install("hello")
        await client.close()

    asyncio.run(main())


@pytest.mark.parametrize("where", ["/metadata/", "/targets/"])
def test_s09_a_body_without_end(store: Path, tmp_path: Path, where: str) -> None:
    async def answer(writer: asyncio.StreamWriter, path: str, file: bytes | None) -> None:
        if where not in path:
            await right(writer, path, file)
            return
        writer.write(b"HTTP/1.1 200 OK\r\n\r\n")
        while True:
            writer.write(bytes(2**16))
            await writer.drain()

    error = refused(store, answer, home=tmp_path / "robot")
    assert isinstance(error, Untrusted) and error.attack == Attack.ENDLESS_DATA


def test_s10_a_byte_now_and_then(store: Path, tmp_path: Path) -> None:
    async def answer(writer: asyncio.StreamWriter, path: str, file: bytes | None) -> None:
        if "/targets/" not in path:
            await right(writer, path, file)
            return
        assert file is not None
        writer.write(f"HTTP/1.1 200 OK\r\nContent-Length: {len(file)}\r\n\r\n".encode())
        for place in range(len(file)):
            writer.write(file[place : place + 1])
            await writer.drain()
            await asyncio.sleep(0.05)

    error = refused(store, answer, home=tmp_path / "robot", limits=DeliveryLimits(window=0.5))
    assert isinstance(error, Unreachable)
    assert error.reason == Attack.SLOW.value


@pytest.mark.parametrize("tenth", range(10))
def test_s11_cut_at_every_tenth(store: Path, tmp_path: Path, tenth: int) -> None:
    async def answer(writer: asyncio.StreamWriter, path: str, file: bytes | None) -> None:
        if "/targets/" not in path:
            await right(writer, path, file)
            return
        assert file is not None
        writer.write(f"HTTP/1.1 200 OK\r\nContent-Length: {len(file)}\r\n\r\n".encode() + file[: len(file) * tenth // 10])

    assert isinstance(refused(store, answer, home=tmp_path / "robot"), Unreachable)


def in_sandbox(store: Path, home: Path, how: str, *words: str) -> list[dict[str, Any]]:
    """Run the script in a sandbox that `words` complete: options of bubblewrap, and a command before the script's."""
    command = ["bwrap", "--die-with-parent", "--ro-bind", "/", "/", "--dev", "/dev", "--proc", "/proc", *words]
    command += [sys.executable, str(SCRIPT), str(store), str(home), how]
    env = {**os.environ, "TMPDIR": "/dev/shm"}  # the sandbox's own
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False, env=env)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.fixture
def home(store: Path, tmp_path: Path) -> Path:
    """A robot's, with hello 1.0.0, whose store offers 1.1.0 now."""
    home = tmp_path / "home"
    home.mkdir()
    (told,) = in_sandbox(store, home, "once", "--bind", str(home), str(home))
    assert told["version"] == "1.0.0"
    publish_new(store)
    return home


def test_s17_disk_full_at_every_step(store: Path, home: Path, tmp_path: Path) -> None:
    """Free space grows from nothing until the update succeeds: the disk is full while downloading, extracting, committing."""
    small = tmp_path / "small"
    small.mkdir()
    fill = ["bash", "-c", f'cp -r {home}/. {small} && exec "$@"', "x"]
    *failed, last = in_sandbox(store, small, "full", "--size", str(3 * 2**20), "--tmpfs", str(small), *fill)
    assert last["current"] == last["version"] == "1.1.0"
    assert {told["phase"] for told in failed} >= {"downloading", "verified"}
    for told in failed:
        assert told["kind"] == "refused" and "No space left" in told["error"], told
        assert (told["current"], told["program"], told["left"]) == ("1.0.0", "old\n", []), told


def test_s18_read_only_disk(store: Path, home: Path) -> None:
    (told,) = in_sandbox(store, home, "once")
    assert told["kind"] == "refused" and "Read-only file system" in told["error"]
    assert (told["current"], told["program"], told["left"]) == ("1.0.0", "old\n", [])
