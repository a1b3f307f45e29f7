"""Our client calls the services of a real Hop server, as that was recorded to answer."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from fakes.real_hop import RealHop
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_hop.hop_peer import HopPeer


def run(test: Callable[[RealHop, HopPeer], Awaitable[None]], **options: Any) -> None:
    async def main() -> None:
        async with asyncio.timeout(60), RealHop() as hop:
            peer = HopPeer(hop.url, **options)
            try:
                await test(hop, peer)
            finally:
                await peer.close()

    asyncio.run(main())


def test_arguments_of_all_json_types() -> None:
    async def test(hop: RealHop, peer: HopPeer) -> None:
        args = [1, -2.5, "ż & ?", True, None, [1, [2]], {"a": {"b": "c"}}]
        assert await peer.call("echo", *args) == args
        assert await peer.call("echo") == []
        assert [first.split()[0] for first, _, _ in hop.requests] == ["PUT", "PUT"]
        assert await peer.call("first", "hé") == "hé"
        assert hop.requests[0][1]["hop-serialize"] == "json"

    run(test)


def test_long_arguments_go_as_parts() -> None:
    async def test(hop: RealHop, peer: HopPeer) -> None:
        text = "x\r\n--y" * 2000
        assert await peer.call("echo", text, 7, 1.5) == [text, 7, b"f\x01\x031.5".hex()]
        first, headers, _ = hop.requests[0]
        assert first.startswith("POST /hop/echo ") and headers["content-type"].startswith("multipart/form-data")
        with pytest.raises(Invalid, match="JSON"):
            await peer.call("echo", {"a": "x" * 5000})

    run(test)


def test_answers_in_every_encoding() -> None:
    async def test(_: RealHop, peer: HopPeer) -> None:
        assert await peer.call("binary") == await peer.call("hexadecimal") == {"a": 1}
        assert await peer.call("javascript") == {"x": "(hi)", "l": [1, []]}
        with pytest.raises(Invalid):
            await peer.call("rubbish")

    run(test)


def test_node_s_server() -> None:
    async def test(hop: RealHop, peer: HopPeer) -> None:
        found = [await peer.call("node", kind) for kind in "snjtzu"]
        assert found == ["hé", 1.5, {"a": []}, True, None, None]
        assert hop.requests[0][0].startswith("GET /hop/node?hop-serialize=json-url&hop-arguments=")

    run(test, node=True)


def test_named_fields_and_files(tmp_path: Path) -> None:
    (tmp_path / "f.txt").write_text("content")

    async def test(_: RealHop, peer: HopPeer) -> None:
        assert await peer.call_named("echo", {"c": "x"}, {"file": tmp_path / "f.txt"}) == ["x", "content"]

    run(test)


@pytest.mark.parametrize(
    ("service", "leaf", "status", "words"),
    [
        ("nix", Refused, 404, "404"),
        ("secret", Refused, 401, "401"),
        ("throws", Bug, 500, "500"),
        ("rejects", Bug, 500, "wrong"),
    ],
)
def test_errors(service: str, leaf: type[HopError], status: int, words: str) -> None:
    async def test(_: RealHop, peer: HopPeer) -> None:
        with pytest.raises(leaf, match=words) as caught:
            await peer.call(service)
        assert caught.value.status == status

    run(test)


def test_basic_authentication() -> None:
    async def test(_: RealHop, peer: HopPeer) -> None:
        assert await peer.call("secret") == "told"

    run(test, user="hugo", password="pw")


def test_nobody_there() -> None:
    async def main() -> None:
        peer = HopPeer("http://127.0.0.1:1")
        with pytest.raises(Unreachable):
            await peer.call("echo")
        await peer.close()

    asyncio.run(main())
