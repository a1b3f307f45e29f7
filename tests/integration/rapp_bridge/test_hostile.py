"""Clients that mean harm, or are broken: the bridge goes on, and a client beside them is served."""

import asyncio
import resource
import struct
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import cbor2
import pytest

from fakes.bridge_fuzz import SEEDS, Fuzz, new_seed
from fakes.bridge_neighbours import PATIENCE, Peer
from fakes.bridge_wire import BINARY, CLOSE, CUT, PING, PONG, Wire, framed, request

FRAME_LIMIT = 100_000
CROWD = 1000
FEW = 256  # descriptors that the bridge is started with
ENTRY = 2  # s


@pytest.fixture(scope="module")
def bridge(start_for_module: Any, peer: Peer) -> Any:
    """One for all tests of this file: that it serves to the end shows what each of them leaves behind."""
    words = ("--entry-timeout", ENTRY, "--ping-interval", ENTRY, "--frame-limit", FRAME_LIMIT, "--linger", "0.5", "--names", 100)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (FEW, hard))
    try:
        return start_for_module("rapp_bridge", "--port", "0", *map(str, words))
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@asynccontextmanager
async def witness(url: str) -> AsyncIterator[Wire]:
    """A client that was there before, and is served as ever after."""
    wire = await Wire.open(url)
    wire.send(op="subscribe", topic="/latched", type="std_msgs/String")
    assert (await wire.receive("publish"))["msg"] == {"data": "kept"}
    await served(wire)
    alive = asyncio.create_task(stay_alive(wire))
    try:
        yield wire
        await served(wire)
    finally:
        alive.cancel()
        wire.leave()


async def stay_alive(wire: Wire) -> None:
    """Be heard, as clients are that answer pings: this one does not read all the time."""
    while True:
        await asyncio.sleep(ENTRY / 4)
        wire.raw(framed(b"", PONG))


async def served(wire: Wire) -> None:
    wire.send(op="call_service", service="/say", args=["as ever"], id="w")
    assert (await wire.receive("service_response"))["values"]["message"] == "as ever"


@pytest.mark.parametrize(
    ("sent", "status"),
    [
        pytest.param(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(600) + b"\r\n\r\n", "400", id="TLS"),
        pytest.param(b"\r\n\r\n", "400", id="nothing"),
        pytest.param(b"\xff" * 70_000, "431", id="no-end"),
        pytest.param(b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 5000, "431", id="many-headers"),
        pytest.param(b"GET / HTTP/1.1\r\nX: " + b"y" * 70_000, "431", id="long-header"),
        pytest.param(b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n", "426", id="page"),
        pytest.param(b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n", "400", id="post"),
        pytest.param(b"GET / HTTP/1.1", "408", id="half-a-request"),
        pytest.param(b"", "408", id="silence"),
    ],
)
def test_who_cannot_shake_hands_is_turned_away_in_bounded_time(url: str, sent: bytes, status: str) -> None:
    async def story() -> None:
        async with witness(url):
            wire = await Wire.connect(url)
            wire.raw(sent)
            async with asyncio.timeout(PATIENCE):
                try:
                    answer = await wire.reader.read()
                except ConnectionResetError:  # more was sent than was read, so the answer may be lost
                    answer = b""
            assert answer.startswith(f"HTTP/1.1 {status} ".encode()) or (not answer and status == "431")
            wire.leave()

    asyncio.run(story())


EMPTY_PART = framed(b"", first=0)


@pytest.mark.parametrize(
    ("sent", "code"),
    [
        pytest.param(b"\x81\x05hello", 1002, id="not-masked"),
        pytest.param(framed(b"{}", first=0xC1), 1002, id="reserved-bit"),
        pytest.param(framed(b"{}", first=0x83), 1002, id="unknown-opcode"),
        pytest.param(framed(b"x" * 126, PING), 1002, id="long-ping"),
        pytest.param(framed(b"", first=PING), 1002, id="ping-in-parts"),
        pytest.param(framed(b"{}", first=0), 1002, id="continues-nothing"),
        pytest.param(framed(b"{", first=1) + framed(b"}"), 1002, id="begins-twice"),
        pytest.param(b"\x81\xff" + struct.pack(">Q", 1 << 63), 1009, id="9-exabytes"),
        pytest.param(b"\x82\xff" + struct.pack(">Q", FRAME_LIMIT + 1) + bytes(4), 1009, id="over-the-limit"),
        pytest.param(framed(b"x" * 60_000, first=1) + framed(b"x" * 60_000, first=0), 1009, id="over-it-in-parts"),
        pytest.param(framed(b"{", first=1) + EMPTY_PART * 40_000, 1009, id="endless-parts"),
        pytest.param(framed(b"\x03", CLOSE), 1000, id="half-a-code"),
        pytest.param(b"\x81", CUT, id="half-a-head-and-silence"),
        pytest.param(framed(b'{"op":"settle"}')[:-3], CUT, id="half-a-frame-and-silence"),
    ],
)
def test_a_broken_frame_ends_its_own_connection_only(url: str, sent: bytes, code: int) -> None:
    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            wire.raw(sent)
            found, _, said = await wire.ending()
            assert found == code  # though more was on its way
            assert code != 1009 or "cannot take a message of" in said[0]
            wire.leave()

    asyncio.run(story())


def text(**fields: Any) -> bytes:
    return framed(b"{" + b",".join(b'"%b":%b' % (name.encode(), str(value).encode()) for name, value in fields.items()) + b"}")


def binary(value: Any) -> bytes:
    return framed(cbor2.dumps(value), BINARY)


SAY = {"op": '"call_service"', "service": '"/say"'}
HOSTILE = {
    "bad-utf8": framed(b'{"op":"\xff\xfe"}'),
    "utf8-cut": framed('{"op":"ü'.encode()[:-1]),
    "surrogate": framed(b'{"op":"publish","topic":"/h","msg":{"data":"\\ud800"}}'),
    "braces": framed(b"{" * 6000),
    "deep-lists": framed(b'{"op":"publish","topic":"/h","msg":' + b"[" * 40_000 + b"]" * 40_000 + b"}"),
    "deep-objects": framed(b'{"op":"publish","topic":"/h","msg":' + b'{"a":' * 900 + b"1" + b"}" * 900 + b"}"),
    "deep-values": framed(
        b'{"op":"service_response","service":"/h","id":"1","result":true,"values":' + b"[" * 900 + b"]" * 900 + b"}"
    ),
    "huge-float": text(**SAY, args="[1e999]", id=1),
    "huge-integer": text(**SAY, args=f"[{'9' * 5000}]", id=1),
    "huge-id": text(**SAY, id="9" * 400),
    "huge-timeout": text(**SAY, timeout="9" * 400, args='["x"]', id=1),
    "nan-for-a-text": text(**SAY, args="[NaN]"),
    "nan-for-an-id": text(**SAY, id="NaN"),
    "nan-and-more": text(**SAY, args="[NaN]}", id=1),
    "infinite-and-deep": text(**SAY, args=f"[Infinity, {'[' * 900}{']' * 900}]"),
    "id-is-an-object": text(**SAY, id='{"a":1}'),
    "id-is-a-list-and-op-is-off": text(op='"dance"', id="[1]"),
    "fragment-size-is-text": text(op='"subscribe"', topic='"/latched"', type='"std_msgs/String"', fragment_size='"x"'),
    "fragment-size-is-text-in-a-call": text(**SAY, fragment_size='"x"'),
    "fragment-size-is-0": text(**SAY, fragment_size=0),
    "fragment-size-in-a-publish": text(op='"dance"', fragment_size='{"x":[]}'),
    "png-field": text(op='"dance"', png='"x"'),
    "png-op": text(op='"png"', data='"AAAA"'),
    "interval": text(op='"dance"', message_intervall="-5"),
    "compression-is-a-list": text(op='"subscribe"', topic='"/latched"', compression="[]"),
    "throttle-is-huge": text(op='"subscribe"', topic='"/latched"', throttle_rate=10**30),
    "topic-is-long": text(op='"advertise"', topic=f'"/{"h" * 90_000}"', type='"std_msgs/String"'),
    "topic-is-a-path": text(op='"subscribe"', topic='"../../etc/passwd"', type='"std_msgs/String"'),
    "topic-has-nul": text(op='"subscribe"', topic='"/h\\u0000"', type='"std_msgs/String"'),
    "type-is-a-module": text(op='"advertise"', topic='"/h"', type='"os/system"'),
    "type-is-a-path": text(op='"advertise"', topic='"/h"', type='"../../x"'),
    "type-has-nul": text(op='"advertise"', topic='"/h"', type='"std_msgs/String\\u0000"'),
    "service-type-is-ours": text(op='"advertise_service"', service='"/h"', type='"rapp_bridge/config"'),
    "service-is-the-bridges": text(op='"advertise_service"', service='"/rosapi/topics"', type='"std_srvs/Empty"'),
    "fragment-total": text(op='"fragment"', id='"f"', num=0, total=10**15, data='""'),
    "fragment-number": text(op='"fragment"', id='"f"', num=-1, total=2, data='""'),
    "fragment-in-fragment": text(
        op='"fragment"', id='"f"', num=0, total=1, data=r'"{\"op\":\"fragment\",\"id\":1,\"num\":0,\"total\":1,\"data\":\"\"}"'
    ),
    "param-name": text(op='"call_service"', service='"/rosapi/set_param"', args=r'["\u0000<&>", "1"]'),
    "param-deep": text(op='"call_service"', service='"/rosapi/set_param"', args=f'["/h", "{"[" * 900}{"]" * 900}"]'),
    "param-controls": text(op='"call_service"', service='"/rosapi/set_param"', args=r'["/h", "\"\\u0000\""]'),
    "rosapi-type": text(op='"call_service"', service='"/rosapi/message_details"', args='["../../x"]'),
    "answer-to-nobody": text(op='"service_response"', service='"/say"', id='"1"', result="true", values="{}"),
    "cbor-bignum-id": binary({"op": "call_service", "service": "/say", "id": 1 << 5000}),
    "cbor-bignum-id-of-dance": binary({"op": "dance", "id": 1 << 5000}),
    "cbor-bignum": binary({"op": "call_service", "service": "/say", "args": [1 << 300_000]}),
    "cbor-bignum-key": binary({"op": "call_service", "service": "/say", "args": {1 << 300_000: 1}}),
    "cbor-deep": framed(b"\xa1\x61a" + b"\x81" * 60_000, BINARY),
    "cbor-long-string": framed(b"\xa1\x61a\x7b" + b"\x7f" * 8, BINARY),
    "cbor-endless": framed(b"\xbf\x62op\x7f" + b"\x61a" * 10_000, BINARY),
    "cbor-shared": framed(b"\xd8\x1c\xa1\x62op\xd8\x1d\x00", BINARY),
    "cbor-floats": binary({"op": "publish", "topic": "/latched", "msg": cbor2.CBORTag(85, b"abc")}),
    "bson": framed(b"\x1a\x00\x00\x00\x02op\x00\x06\x00\x00\x00dance\x00\x00", BINARY),
    "nothing-binary": framed(b"", BINARY),
}
"""Frames that upstream, or a parser behind it, has choked on, or could."""


@pytest.mark.parametrize("sent", HOSTILE.values(), ids=HOSTILE.keys())
def test_a_hostile_message_is_told_and_deafens_nobody(url: str, sent: bytes) -> None:
    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            wire.raw(sent)
            while (found := await wire.receive_any())["op"] not in ("status", "service_response"):
                pass
            assert found.get("level") == "error" or found["op"] == "service_response"
            assert "cannot " in str(found) or found.get("result")
            await wire.settle()
            await served(wire)
            wire.leave()

    asyncio.run(story())


@pytest.mark.parametrize("seed", [*SEEDS, new_seed()], ids=str)
def test_fuzzed_messages_leave_the_connection_and_the_bridge_alive(url: str, bridge: Any, seed: int) -> None:
    async def story() -> None:
        fuzz = Fuzz(seed)
        async with witness(url) as other:
            for _ in range(6):
                wire = await Wire.open(url)
                for _ in range(100):
                    payload, is_binary = fuzz.frame()
                    wire.raw(framed(payload, BINARY) if is_binary else framed(payload))
                wire.send(op="set_level", level="error")
                await wire.settle()
                await served(other)
                wire.leave()

    asyncio.run(story())
    assert bridge.process.poll() is None


@pytest.mark.parametrize("seed", [*SEEDS, new_seed()], ids=str)
def test_random_bytes_end_their_own_connections_only(url: str, seed: int) -> None:
    async def story() -> None:
        chance = Fuzz(seed).random
        async with witness(url) as other:
            for turn in range(60):
                wire = await (Wire.open(url) if turn % 2 else Wire.connect(url))
                wire.raw(chance.randbytes(chance.randrange(1, 3000)) if turn % 3 else request({})[:-1])
                wire.leave()
            await served(other)

    asyncio.run(story())


def test_a_slow_loris_is_cut_off_while_others_are_served(url: str) -> None:
    async def drip(wire: Wire) -> bytes:
        """A byte now and then, of a request that never ends."""
        answer = asyncio.create_task(wire.reader.read())
        while not answer.done():
            wire.raw(b"x")
            await asyncio.wait([answer], timeout=0.2)
        return answer.result() if not answer.exception() else b""

    async def story() -> None:
        async with witness(url) as other:
            lorises = [await Wire.connect(url) for _ in range(100)]
            drops = [asyncio.create_task(drip(loris)) for loris in lorises]
            while not all(drop.done() for drop in drops):
                await served(other)
                await asyncio.sleep(0.1)
            assert all(b" 408 " in drop.result() or not drop.result() for drop in drops)

    asyncio.run(asyncio.wait_for(story(), PATIENCE + ENTRY))


def test_a_thousand_connections_are_served_and_then_forgotten(url: str, bridge: Any) -> None:
    """More than the descriptors that the bridge was started with: it asks the system for what it needs."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)

    async def story() -> None:
        async with witness(url) as other:
            crowd: list[Wire] = []
            while len(crowd) < CROWD:
                crowd += await asyncio.gather(*(Wire.open(url) for _ in range(100)))
            for wire in crowd:
                wire.send(op="subscribe", topic="/latched", type="std_msgs/String")
            kept = await asyncio.gather(*(wire.receive("publish") for wire in crowd))
            assert [each["msg"]["data"] for each in kept] == ["kept"] * CROWD
            await served(other)
            for wire in crowd:
                wire.leave()
            other.send(op="subscribe", topic="/client_count", type="std_msgs/Int32")
            while (await other.receive("publish"))["msg"]["data"] != 1:
                pass

    asyncio.run(story())
