"""The W items of the project's list of hostile inputs, one test each by its number; other files go further into most of them.

In each a witness, connected before, is served afterwards as ever.
"""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest

from fakes.bridge_neighbours import PATIENCE, Peer
from fakes.bridge_wire import BINARY, CUT, PING, TurnedAwayError, Wire, framed
from fakes.bridge_witness import known, served, told, witness

MANY = 50  # names a client may hold
STRING = "std_msgs/String"


@pytest.fixture(scope="module")
def bridge(start_for_module: Any, peer: Peer) -> Any:
    limits = {"frame-limit": 100_000, "names": MANY, "queue-limit": 1_000_000, "linger": 0.5, "entry-timeout": 3, "call-timeout": 3}
    words = [str(word) for name, value in limits.items() for word in (f"--{name}", value)]
    return start_for_module("rapp_bridge", "--port", "0", *words)


def test_w03_op_unknown_list_or_missing(url: str) -> None:
    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            for fields in ({"op": "dance"}, {"op": ["publish"]}, {"op": None}, {"op": 1}, {"topic": "/x"}, {}):
                wire.send(**fields)
                await told(wire)
            wire.leave()

    asyncio.run(story())


def test_w04_many_subscriptions_on_one_socket(url: str) -> None:
    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            for number in range(20 * MANY):
                wire.send(op="subscribe", topic=f"/w04/n{number}", type=STRING)
            await told(wire, f"holds {MANY} topics and services")
            wire.leave()

    asyncio.run(story())


def test_w05_subscribe_to_everything(url: str, roscore: str) -> None:
    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            for topic in ("*", "/*", "/latched*", "", "/"):
                wire.send(op="subscribe", topic=topic, type=STRING)
                await told(wire)
            assert not known(roscore, "*")
            wire.leave()

    asyncio.run(story())


def fragment(number: int, total: int, data: str = "x", key: str = "f") -> dict[str, Any]:
    return {"op": "fragment", "id": key, "num": number, "total": total, "data": data}


def test_w06_long_messages_and_fragments_that_never_fit(url: str) -> None:
    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            wire.raw(framed(b"x" * 100_001))
            assert (await wire.ending())[0] in (1009, CUT)
            wire = await Wire.open(url)
            for fields in (fragment(0, 2**31), fragment(-1, 2), fragment(2, 2), fragment(0, 0)):
                wire.send(**fields)
                await told(wire)
            wire.send(**fragment(0, 3, key="never"))
            text = json.dumps({"op": "call_service", "service": "/say", "args": ["whole"], "id": "w06"})
            for number in (2, 0, 0, 1):  # out of order, and one twice
                wire.send(**fragment(number, 3, text[number * 30 : None if number == 2 else number * 30 + 30], "good"))
            assert (await wire.receive("service_response"))["values"]["message"] == "whole"
            for number in range(500):
                wire.send(**fragment(0, 2, "y" * 5000, f"open-{number}"))
            await wire.settle()
            wire.leave()

    asyncio.run(story())


def test_w07_png_and_cbor_malformed_or_bombs(url: str) -> None:
    binary = [
        b"\xa1\x62op",
        b"\xa1\x61a" + b"\x81" * 60_000,
        b"\xa1\x61a\x7b" + b"\x7f" * 8,
        b"\xff",
        b"\xd8\x1c\xa1\x62op\xd8\x1d\x00",
    ]

    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            for frame in binary:
                wire.raw(framed(frame, BINARY))
                await told(wire)
            for data in ("AAAA", "not base64", "iVBORw0KGgo=", "A" * 50_000, 1):
                wire.send(op="png", data=data)
                await told(wire)
            wire.leave()

    asyncio.run(story())


def test_w08_a_client_that_never_reads(url: str, bridge: Any) -> None:
    def memory() -> int:
        return int(Path(f"/proc/{bridge.process.pid}/statm").read_text().split()[1]) * 4096

    async def story() -> None:
        async with witness(url) as other:
            deaf = await Wire.open(url)
            deaf.writer.transport.pause_reading()  # type: ignore[attr-defined]
            deaf.send(op="subscribe", topic="/w08", type=STRING, queue_length=10)
            other.send(op="subscribe", topic="/w08", type=STRING)
            other.send(op="advertise", topic="/w08", type=STRING)
            await other.settle()
            before = memory()
            for _ in range(20):
                for _ in range(20):
                    other.send(op="publish", topic="/w08", msg={"data": "x" * 50_000})
                await served(other)
            assert memory() - before < 20_000_000  # a third of what was sent
            deaf.leave()

    asyncio.run(story())


def test_w09_coming_and_going_while_the_bridge_sends(url: str) -> None:
    async def story() -> None:
        async with witness(url) as other:
            for _ in range(500):
                wire = await Wire.open(url)
                wire.send(op="subscribe", topic="/latched", type=STRING)
                wire.leave()
            await served(other)

    asyncio.run(asyncio.wait_for(story(), 5 * PATIENCE))


def test_w10_idle_and_half_open_connections(url: str) -> None:
    async def story() -> None:
        async with witness(url) as other:
            idle = [await Wire.open(url) for _ in range(300)]
            silent = [await Wire.connect(url) for _ in range(300)]
            await served(other)
            for wire in silent:  # without a handshake they are sent away
                async with asyncio.timeout(PATIENCE):
                    assert b" 408 " in await wire.reader.read()
            for wire in (*idle, *silent):
                wire.leave()

    asyncio.run(asyncio.wait_for(story(), 5 * PATIENCE))


def test_w11_wrong_origin_and_frames_against_the_rules(url: str) -> None:
    broken = [
        (b"\x81\x05hello", 1002),  # no mask
        (framed(b"{}", first=0xC1), 1002),  # reserved bit
        (framed(b"\x03\xe8" + b"x" * 65_533, 8), 1002),  # a long reason
        (framed(b"x" * 126, PING), 1002),
    ]

    async def story() -> None:
        async with witness(url):
            with pytest.raises(TurnedAwayError, match="403"):
                await Wire.open(url, {"Origin": "https://elsewhere.example"})
            for sent, code in broken:
                wire = await Wire.open(url)
                wire.raw(sent)
                found = (await wire.ending())[0]
                assert found == code or (found == CUT and len(sent) > 1000)
            wire = await Wire.open(url)
            for _ in range(5000):
                wire.raw(framed(b"flood", PING))
            wire.leave()

    asyncio.run(story())


def test_w12_calls_without_server_and_answers_without_call(url: str) -> None:
    async def story() -> None:
        async with witness(url):
            caller, provider = await Wire.open(url), await Wire.open(url)
            caller.send(op="call_service", service="/w12/nowhere", id="1")
            assert (await caller.receive("service_response"))["result"] is False
            provider.send(op="advertise_service", service="/w12/said", type="rapp_msgs/Say")
            await provider.settle()
            caller.send(op="call_service", service="/w12/said", args=["x", ""], id="2")
            asked = await provider.receive("call_service")
            for key in ("another", asked["id"] + "x"):
                provider.send(op="service_response", service="/w12/said", id=key, result=True, values={"message": "wrong"})
                await told(provider)
            provider.leave()  # the server dies in the call
            assert (await caller.receive("service_response"))["result"] is False
            caller.leave()

    asyncio.run(story())


def test_w12_an_answer_after_the_caller_has_left(url: str) -> None:
    async def story() -> None:
        async with witness(url):
            caller, provider = await Wire.open(url), await Wire.open(url)
            provider.send(op="advertise_service", service="/w12/late", type="rapp_msgs/Say")
            await provider.settle()
            caller.send(op="call_service", service="/w12/late", args=["x", ""], id="1")
            asked = await provider.receive("call_service")
            caller.leave()
            provider.send(op="service_response", service="/w12/late", id=asked["id"], result=True, values={"message": "late"})
            await provider.settle()
            provider.leave()

    asyncio.run(story())


def test_w13_a_message_that_is_not_of_the_advertised_type(url: str) -> None:
    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            wire.send(op="advertise", topic="/w13", type=STRING)
            wire.send(op="subscribe", topic="/w13", type=STRING)
            for message in ({"data": 1}, {"date": "x"}, {"data": ["x"]}, [1], "x"):
                wire.send(op="publish", topic="/w13", msg=message)
                await told(wire)
            wire.send(op="advertise", topic="/w13", type="std_msgs/Int32")
            await told(wire)
            wire.send(op="publish", topic="/w13", msg={"data": "right"})
            assert (await wire.receive("publish"))["msg"] == {"data": "right"}
            wire.leave()

    asyncio.run(story())


@pytest.mark.parametrize("field", ["throttle_rate", "queue_length", "fragment_size"])
def test_w15_negative_and_huge_numbers(url: str, field: str) -> None:
    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            for value in (-1, 10**30, 1.5, "1", [1]):
                wire.send(**{"op": "subscribe", "topic": "/latched", "type": STRING, field: value})
            await told(wire)
            wire.send(op="unsubscribe", topic="/latched")
            wire.send(op="subscribe", topic="/latched", type=STRING, id="as ever")
            assert (await wire.receive("publish"))["msg"] == {"data": "kept"}
            wire.leave()

    asyncio.run(story())


def test_w16_the_robot_s_clock_does_not_decide_when_a_throttled_message_goes(url: str) -> None:
    """Stamps that go backwards, as a simulated or corrected clock gives them, hold nothing back."""

    async def story() -> None:
        async with witness(url):
            wire = await Wire.open(url)
            wire.send(op="advertise", topic="/w16", type="std_msgs/Header")
            wire.send(op="subscribe", topic="/w16", type="std_msgs/Header", throttle_rate=50, queue_length=5)
            await wire.settle()
            await asyncio.sleep(0.5)  # rospy connects
            for seconds in (2_000_000_000, 1_000_000_000, 1):
                wire.send(op="publish", topic="/w16", msg={"frame_id": str(seconds), "stamp": {"secs": seconds, "nsecs": 0}})
            found = [(await wire.receive("publish"))["msg"]["frame_id"] for _ in range(3)]
            assert found == ["2000000000", "1000000000", "1"]
            wire.leave()

    asyncio.run(story())
