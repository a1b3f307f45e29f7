"""W01, W02 and W14 of the project's list of hostile inputs: before and beyond what a token opens (see `test_named_items`)."""

import asyncio
import ssl
from pathlib import Path
from typing import Any

import pytest

from fakes.bridge_certificate import certificate
from fakes.bridge_neighbours import Peer
from fakes.bridge_wire import BINARY, Wire, framed
from fakes.bridge_witness import known, told, witness

TOKEN = "the-token-of-one-client"
ACCESS = f'[clients.one]\ntoken = "{TOKEN}"\ntopics = ["/one/*", "/latched"]\nservices = ["/say"]\n'
STRING = "std_msgs/String"
PASS = {"Authorization": f"Bearer {TOKEN}"}
ACT = framed(b'{"op":"advertise","topic":"/one/must_not_be","type":"std_msgs/String"}')


@pytest.fixture(scope="module")
def pem(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return certificate(tmp_path_factory.mktemp("tls"))


@pytest.fixture(scope="module")
def guarded(start_for_module: Any, peer: Peer, pem: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> str:
    """The address of a bridge with tokens."""
    file = tmp_path_factory.mktemp("access") / "access.toml"
    file.write_text(ACCESS)
    words = ["--certfile", pem[0], "--keyfile", pem[1], "--access-file", file, "--entry-timeout", "3"]
    return f"wss://127.0.0.1:{start_for_module('rapp_bridge', '--port', '0', *map(str, words)).ready['port']}"


@pytest.fixture
def tls(pem: tuple[Path, Path]) -> ssl.SSLContext:
    return ssl.create_default_context(cafile=str(pem[0]))


def test_w01_a_frame_before_authentication(guarded: str, tls: ssl.SSLContext, roscore: str) -> None:
    async def story() -> None:
        async with witness(guarded, PASS, tls):
            wire = await Wire.open(guarded, None, tls)
            wire.raw(ACT)
            assert (await wire.ending())[:2] == (1008, "not authenticated")
            assert not known(roscore, "must_not_be")

    asyncio.run(story())


def test_w02_frames_that_make_the_auth_parser_stumble(guarded: str, tls: ssl.SSLContext, roscore: str) -> None:
    right = f'{{"op":"auth","token":"{TOKEN}"}}'.encode()
    frames = [right + ACT[6:], right + b"x", b"[" + right + b"]", b'"auth"', b"1", b"", b"\xff", b'{"op":"auth"}']

    async def story() -> None:
        async with witness(guarded, PASS, tls):
            for frame in [*map(framed, frames), framed(b"\x00", BINARY), framed(b"\xa1\x62op\x64auth", BINARY)]:
                wire = await Wire.open(guarded, None, tls)
                wire.raw(frame + ACT)
                assert (await wire.ending())[0] == 1008
            assert not known(roscore, "must_not_be")

    asyncio.run(story())


def test_w14_a_topic_that_the_token_does_not_open(guarded: str, tls: ssl.SSLContext, roscore: str) -> None:
    async def story() -> None:
        async with witness(guarded, PASS, tls) as wire:
            for topic in ("/other/x", "/one/../other/x", "/cmd_vel"):
                wire.send(op="publish", topic=topic, type=STRING, msg={"data": "x"})
                await told(wire)
            assert not known(roscore, "/other/x") and not known(roscore, "cmd_vel")

    asyncio.run(story())
