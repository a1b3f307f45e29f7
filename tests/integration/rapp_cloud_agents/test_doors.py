"""What one cloud agent may take of the platform through its door."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from rapp_cloud.cloud_agents.doors import CALLS, LIMITS, MAX_CALL, Doors
from rapp_hop.client import HopClient
from rapp_hop.errors import Unreachable

Test = Callable[[Doors, Path], Awaitable[None]]


@pytest.fixture
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("d")


def before_a_platform_that_never_answers(folder: Path, test: Test) -> None:
    async def main() -> None:
        async def forever(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            await reader.read()
            writer.close()

        doors = Doors(folder / "house", folder / "uploads", lambda _token: None)
        door = doors.open("nao", frozenset({"weigh"}), folder / "door")
        async with asyncio.timeout(60), await asyncio.start_unix_server(forever, doors.platform):
            await test(doors, folder / "door")
            await door.close()
        doors.close()

    asyncio.run(main())


async def post(door: Path, announced: int, sent: int) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Begin a call."""
    reader, writer = await asyncio.open_unix_connection(door)
    head = f"POST /hop/weigh HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: {announced}\r\n\r\n"
    writer.write(head.encode() + bytes(sent))
    await writer.drain()
    return reader, writer


def test_calls_at_once_are_bounded(short: Path) -> None:
    async def test(doors: Doors, door: Path) -> None:
        client = HopClient("http://a_rep", socket_path=door)
        calls = [asyncio.create_task(client.call("weigh")) for _ in range(CALLS + 1)]
        done, _ = await asyncio.wait(calls, return_when=asyncio.FIRST_COMPLETED)
        with pytest.raises(Unreachable, match=f"{CALLS} calls of this cloud agent are open"):
            await done.pop()
        await client.close()
        for call in calls:
            call.cancel()
        await asyncio.gather(*calls, return_exceptions=True)

    before_a_platform_that_never_answers(short, test)


def test_connections_are_bounded(short: Path) -> None:
    async def test(doors: Doors, door: Path) -> None:
        lines = [await asyncio.open_unix_connection(door) for _ in range(LIMITS.connections + 1)]
        assert (await lines[-1][0].readline()).startswith(b"HTTP/1.1 503 ")
        for _, writer in lines:
            writer.close()

    before_a_platform_that_never_answers(short, test)


def test_unfinished_posts_do_not_fill_the_platform_s_disk(short: Path) -> None:
    async def test(doors: Doors, door: Path) -> None:
        size = MAX_CALL - 2**20
        kept = [await post(door, size, size - 1) for _ in range(2)]
        reader, writer = await post(door, size, size)
        head = await reader.readuntil(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 503 ") and b"Retry-After: " in head
        assert json.loads(await reader.read(1000))["error"]["kind"] == "unreachable"
        for one in (*kept, (reader, writer)):
            one[1].close()

    before_a_platform_that_never_answers(short, test)
