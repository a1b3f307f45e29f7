"""The client repeats what is safe to repeat, and nothing else; callbacks and awaited calls are the same call."""

import asyncio
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fakes.hop_house import TOKEN, House, visit
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable

OK = b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: 1\r\n\r\n1"
BUSY = b"HTTP/1.1 503 Busy\r\nRetry-After: 1\r\nContent-Length: 0\r\n\r\n"
FAILED = b"HTTP/1.1 503 Away\r\nContent-Length: 0\r\n\r\n"
CUT = b""


class Script:
    """A server that answers each connection by the next of some answers, and keeps what it was sent."""

    def __init__(self, *answers: bytes) -> None:
        self._answers = list(answers)
        self.requests: list[bytes] = []

    async def __aenter__(self) -> "Script":
        self._server = await asyncio.start_server(self._answer, "127.0.0.1", 0)
        self.url = f"http://127.0.0.1:{self._server.sockets[0].getsockname()[1]}"
        return self

    async def __aexit__(self, *_: object) -> None:
        self._server.close()
        await self._server.wait_closed()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await reader.readuntil(b"\r\n\r\n")
        self.requests.append(head)
        writer.write(self._answers.pop(0))
        await writer.drain()
        writer.close()


@pytest.mark.parametrize(
    ("answers", "retries", "leaf", "sent"),
    [
        ((CUT, OK), 0, Unreachable, 1),
        ((CUT, OK), 2, Unreachable, 1),  # it may have run, in a process that is no more
        ((BUSY, BUSY, OK), 2, None, 3),
        ((BUSY, BUSY, OK), 1, Unreachable, 2),
        ((FAILED, OK), 2, Unreachable, 1),  # it may have run
        ((b"HTTP/1.1 403 No\r\nContent-Length: 0\r\n\r\n", OK), 2, Refused, 1),
    ],
)
def test_what_is_repeated(answers: tuple[bytes, ...], retries: int, leaf: type[HopError] | None, sent: int) -> None:
    async def main() -> None:
        async with Script(*answers) as script:
            client = HopClient(script.url, retries=retries)
            if leaf is None:
                assert await client.call("x") == 1
            else:
                with pytest.raises(leaf):
                    await client.call("x")
            assert len(script.requests) == sent
            await client.close()

    asyncio.run(main())


def test_a_get_that_was_cut_is_not_repeated_either() -> None:
    """It calls a service as well."""

    async def main() -> None:
        text = b"HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nContent-Length: 2\r\n\r\nhi"
        async with Script(CUT, text) as script:
            client = HopClient("http://127.0.0.1:1", TOKEN, retries=1)
            page = f"{script.url}/page", {"q": "a b", "n": 2}
            with pytest.raises(Unreachable):
                await client.call_url(*page, method="GET")
            assert await client.call_url(*page, method="GET") == "hi"
            assert len(script.requests) == 2 and TOKEN.encode() not in script.requests[0]
            assert script.requests[1].startswith(b"GET /page?q=a+b&n=2 HTTP/1.1\r\n")
            await client.close()

    asyncio.run(main())


def test_nobody_there_yet_is_waited_for() -> None:
    async def main() -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        client = HopClient(f"http://127.0.0.1:{port}", retries=20)
        call = asyncio.create_task(client.call("x", timeout=60))
        await asyncio.sleep(0.2)
        script = Script(OK)
        server = await asyncio.start_server(script._answer, "127.0.0.1", port)
        async with server:
            assert await call == 1
        assert len(script.requests) == 1
        await client.close()

    asyncio.run(main())


def test_repeating_ends_with_the_call_s_time() -> None:
    async def main() -> None:
        client = HopClient("http://127.0.0.1:1", retries=1000)
        async with asyncio.timeout(60):
            with pytest.raises(Unreachable):
                await client.call("x", timeout=0.5)
        await client.close()

    asyncio.run(main())


def test_with_url_and_call_url_are_the_same_call(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        whole = f"{house.client.base_url}/hop/add"
        assert await house.client.call_url(whole, {"a": 1}) == 2
        assert await house.client.call_url("/hop/add", {"a": 1}, method="GET") == 2
        (tmp_path / "f.txt").write_text("12345")
        cases: list[tuple[str, dict[str, Any], Callable[[Any], bool]]] = [
            ("/hop/add", {"a": 1}, lambda found: bool(found == 2)),
            ("/hop/measure", {"file": tmp_path / "f.txt"}, lambda found: bool(found["size"] == 5)),
            ("/hop/add", {"a": "x"}, lambda found: isinstance(found, Invalid)),
            ("/hop/nix", {}, lambda found: isinstance(found, Refused)),
            ("/hop/add", {"a": object()}, lambda found: isinstance(found, Invalid)),
            ("http://127.0.0.1:1/x", {}, lambda found: isinstance(found, Unreachable)),
        ]
        for url, args, right in cases:
            found: asyncio.Queue[Any] = asyncio.Queue()
            await house.client.with_url(url, args, found.put_nowait, found.put_nowait, 10)
            assert right(found.get_nowait()) and found.empty()

    visit(test, tmp_path)


def test_a_cancelled_call_calls_nobody_back(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        found: list[Any] = []
        task = house.client.with_url("/hop/drip", {"count": 10**9}, found.append, found.append, 60)
        await asyncio.sleep(0.05)
        task.cancel()
        await asyncio.wait([task])
        assert found == [] and await house.alive()

    visit(test, tmp_path)
