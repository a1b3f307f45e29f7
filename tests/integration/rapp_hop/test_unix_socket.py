"""HOP over a UNIX socket: the same server and client, no port."""

import asyncio
import json
from pathlib import Path

import pytest

from rapp_hop.client import MAX_ANSWER, OVERRUN, HopClient
from rapp_hop.errors import Invalid, Refused, Unreachable
from rapp_hop.protocol import WireRequest
from rapp_hop.registry import ServiceRegistry
from rapp_hop.relay import relay
from rapp_hop.results import Stream
from rapp_hop.server import HopServer
from rapp_hop.service import Request, service


@service
def who(request: Request, page: Path) -> str:
    return f"{request.caller} {page.read_text()}"


def test_call_over_a_unix_socket(tmp_path: Path) -> None:
    async def main() -> None:
        server = HopServer(ServiceRegistry([who]), {"t" * 20: "nao"}.get, tmp_path / "uploads")
        server.listen_unix(tmp_path / "hop.sock")
        assert (tmp_path / "hop.sock").stat().st_mode & 0o777 == 0o600
        client = HopClient("http://agent", "t" * 20, socket_path=tmp_path / "hop.sock")
        (tmp_path / "page").write_text("one")
        assert await client.call("who", {}, {"page": tmp_path / "page"}) == "nao one"
        await asyncio.gather(*(client.call("who", {}, {"page": tmp_path / "page"}) for _ in range(20)))
        await server.close()
        with pytest.raises(Unreachable):
            await client.call("who", {}, {"page": tmp_path / "page"})
        await client.close()

    asyncio.run(main())


def test_a_path_that_cannot_be_had_is_refused(tmp_path: Path) -> None:
    async def main() -> None:
        server = HopServer(ServiceRegistry(), {}.get, tmp_path / "uploads")
        (tmp_path / "file").write_text("not a socket")
        for path in (tmp_path / "file", tmp_path / "no" / "folder", tmp_path / ("x" * 200)):
            with pytest.raises(Refused, match="choose another path"):
                server.listen_unix(path)
        assert (tmp_path / "file").read_text() == "not a socket"
        await server.close()

    asyncio.run(main())


@service
def zeros(size: int, chunked: bool) -> Path | Stream:
    pieces = (bytes(min(PIECE, size - start)) for start in range(0, size, PIECE))
    if chunked:
        return Stream(pieces)
    path = Path("zeros").resolve()
    path.write_bytes(b"".join(pieces))
    return path


PIECE = 2**20  # bytes


@pytest.mark.parametrize("chunked", [False, True])
def test_a_relayed_answer_that_is_too_long_is_told_as_such(tmp_path: Path, chunked: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    async def ask(size: int) -> int:
        body = json.dumps({"size": size, "chunked": chunked}).encode()
        request = WireRequest("POST", "/hop/zeros", {"content-type": "application/json"}, body)
        answer = await relay(tmp_path / "hop.sock", request, request.path, 30.0, "t" * 20)
        assert answer.status == 200 and isinstance(answer.body, bytes)
        return len(answer.body)

    async def main() -> None:
        server = HopServer(ServiceRegistry([zeros]), {"t" * 20: "nao"}.get, tmp_path / "uploads")
        server.listen_unix(tmp_path / "hop.sock")
        assert await ask(MAX_ANSWER) == MAX_ANSWER
        for size in (MAX_ANSWER + 1, MAX_ANSWER + 3 * OVERRUN):
            with pytest.raises(Invalid, match=f"the answer of /hop/zeros: it is longer than {MAX_ANSWER} bytes"):
                await ask(size)
        await server.close()

    asyncio.run(main())
