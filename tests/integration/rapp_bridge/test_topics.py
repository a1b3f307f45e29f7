"""Topics both ways, and clients that are slow, leave, or send what is off."""

import asyncio
import io
import json
import struct
import xmlrpc.client
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import cbor2
import pytest
from sensor_msgs.msg import LaserScan
from tornado.websocket import WebSocketClosedError

from fakes.bridge_neighbours import PATIENCE, Clients, Peer, Socket
from fakes.bridge_puppet import Puppet, puppet


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():
            await asyncio.sleep(0.02)


def registered(master: str, name: str) -> set[str]:
    """As what the bridge is registered for this name."""
    _, _, parts = xmlrpc.client.ServerProxy(master).getSystemState("/test")
    kinds = zip(("publisher", "subscriber", "service"), parts, strict=True)
    return {kind for kind, entries in kinds for topic, nodes in entries if topic == name and "/rosbridge" in nodes}


def test_topics_flow_both_ways_and_what_is_latched_reaches_who_comes_late(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            first, second = await clients.new(), await clients.new()
            for socket in (first, second):
                await socket.send(op="subscribe", topic="/latched", type="std_msgs/String")
                assert (await socket.receive("publish"))["msg"] == {"data": "kept"}
            await first.send(op="subscribe", topic="/echoed", type="std_msgs/String", id="s1")
            await second.send(op="advertise", topic="/to_echo", type="std_msgs/String")
            heard = asyncio.create_task(first.receive("publish"))
            while not heard.done():
                await second.send(op="publish", topic="/to_echo", msg={"data": "hello"})
                await asyncio.wait({heard}, timeout=0.1)
            assert heard.result() == {"op": "publish", "topic": "/echoed", "msg": {"data": "hello"}}

    asyncio.run(story())


def test_what_is_published_right_after_advertise_is_not_lost(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            listener, speaker = await clients.new(), await clients.new()
            await listener.send(op="subscribe", topic="/at_once", type="std_msgs/String")
            await listener.settle()
            await speaker.send(op="advertise", topic="/at_once", type="std_msgs/String")
            for number in range(10):
                await speaker.send(op="publish", topic="/at_once", msg={"data": str(number)})
            assert [(await listener.receive("publish"))["msg"]["data"] for _ in range(10)] == [str(n) for n in range(10)]

    asyncio.run(story())


def test_what_a_client_held_is_given_up_when_it_leaves(clients: Clients, roscore: str) -> None:
    async def story() -> None:
        async with clients:
            socket, other = await clients.new(), await clients.new()
            await socket.send(op="subscribe", topic="/held", type="std_msgs/String")
            await socket.send(op="publish", topic="/held", msg={"data": "x"})
            await socket.send(op="advertise_service", service="/held", type="std_srvs/Empty")
            await socket.settle()
            assert registered(roscore, "/held") == {"publisher", "subscriber", "service"}
            await other.send(op="subscribe", topic="/held", type="std_msgs/String")
            await other.settle()
            socket.leave()
            await until(lambda: registered(roscore, "/held") == {"subscriber"})
            await other.send(op="unsubscribe", topic="/held")
            await until(lambda: registered(roscore, "/held") == set())

    asyncio.run(story())


@pytest.mark.parametrize(
    "frame",
    ["", "[]", "{", '"publish"', "{}", '{"op": 3}', '{"op": "dance"}', '{"op": "publish"}', b"\x00\xff", "{" * 6000,
     '{"op":"publish","topic":"/made_up","msg":{}} ]',
     '{"op":"advertise","topic":"/made_up","type":"std_msgs/String"}{"op":"advertise","topic":"/made_up","type":"std_msgs/String"}',
     '[{"op":"advertise","topic":"/made_up","type":"std_msgs/String"}]',
     '{"op":["advertise"],"topic":"/made_up","type":"std_msgs/String"}',
     '{"op":"publish","topic":"/made_up","msg":{}}',
     '{"op":"subscribe","topic":"/made_up"}',
     '{"op":"subscribe","topic":"/made up","type":"std_msgs/String"}',
     '{"op":"subscribe","topic":"/made_up","type":"std_msgs/String","throttle_rate":-1}',
     '{"op":"subscribe","topic":"/latched","type":"std_msgs/Int32"}',
     '{"op":"advertise","topic":"/latched","type":"std_msgs/Int32"}',
     '{"op":"publish","topic":"/latched","msg":{"data":3}}',
     '{"op":"publish","topic":"/latched","msg":{"date":""}}',
     '{"op":"advertise","topic":"/made_up","type":"no_msgs/None"}',
     '{"op":"advertise_service","service":"/made_up","type":"std_msgs/String"}',
     '{"op":"unadvertise_service","service":"/say"}',
     '{"op":"service_response","service":"/say","id":"1","result":true}'],
)  # fmt: skip
def test_a_bad_frame_is_told_and_nothing_else_happens(clients: Clients, peer: Peer, roscore: str, frame: str | bytes) -> None:
    async def story() -> None:
        async with clients:
            socket = await clients.new()
            await socket.raw(frame)
            status = await socket.receive("status")
            assert status["level"] == "error"
            assert status["msg"].startswith("cannot ")
            assert (await socket.call("/say", args=["still here"]))["values"]["message"] == "still here"

    asyncio.run(story())
    assert registered(roscore, "/made_up") == set()


def test_a_frame_over_the_limit_ends_that_connection_only(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            greedy, other = await clients.new(), await clients.new()
            with suppress(WebSocketClosedError):
                await greedy.raw('{"op":"' + "x" * (17 << 20) + '"}')
            # The reason arrives, though there are bytes still on their way that nobody reads any more.
            assert "16777216 is the limit" in (await greedy.receive("status"))["msg"]
            assert await asyncio.wait_for(greedy.connection.read_message(), PATIENCE) is None
            assert (await other.call("/say", args=["fine"]))["values"]["message"] == "fine"

    asyncio.run(story())


def memory(pid: int) -> int:
    """Resident memory in bytes."""
    line = next(line for line in Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) * 1024


async def asleep(port: int, topic: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """A subscriber that never reads its socket again."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port, limit=1024)
    writer.write(b"GET / HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                 b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n")  # fmt: skip
    await reader.readuntil(b"\r\n\r\n")
    text = json.dumps({"op": "subscribe", "topic": topic, "type": "std_msgs/String"}).encode()
    writer.write(bytes([0x81, 0x80 | len(text)]) + bytes(4) + text)
    await writer.drain()
    return reader, writer


def test_a_client_that_never_reads_slows_no_other_and_costs_bounded_memory(clients: Clients, bridge: Any, roscore: str) -> None:
    async def flood(speaker: Socket, listener: Socket, count: int) -> None:
        for number in range(count):  # one at a time: the listener keeps pace, the sleeper does not
            await speaker.send(op="publish", topic="/flood", msg={"data": f"{number:05}" + "x" * 500_000})
            assert (await listener.receive("publish"))["msg"]["data"][:5] == f"{number:05}"

    async def story() -> None:
        async with clients:
            speaker, listener = await clients.new(), await clients.new()
            _, sleeper = await asleep(bridge.ready["port"], "/flood")
            await listener.send(op="subscribe", topic="/flood", type="std_msgs/String")
            await speaker.send(op="advertise", topic="/flood", type="std_msgs/String")
            await until(lambda: registered(roscore, "/flood") == {"publisher", "subscriber"})
            await flood(speaker, listener, 60)
            before = memory(bridge.process.pid)
            await flood(speaker, listener, 400)
            grown = memory(bridge.process.pid) - before
            sleeper.close()
            assert grown < 40_000_000, "200 MB were sent; 4 MB may wait for the sleeper"

    asyncio.run(story())


def test_a_client_may_publish_in_cbor_with_typed_arrays_and_raw(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            listener, speaker = await clients.new(), await clients.new()
            await listener.send(op="subscribe", topic="/in_cbor", type="sensor_msgs/LaserScan")
            await listener.settle()
            await speaker.raw(cbor2.dumps({"op": "advertise", "topic": "/in_cbor", "type": "sensor_msgs/LaserScan"}))
            ranges = cbor2.CBORTag(85, struct.pack("<3f", 0.5, 1.5, float("inf")))
            msg = {"header": {"frame_id": "f"}, "ranges": ranges, "intensities": [1, 2.5]}
            await speaker.raw(cbor2.dumps({"op": "publish", "topic": "/in_cbor", "msg": msg}))
            heard = (await listener.receive("publish"))["msg"]
            assert (heard["ranges"], heard["intensities"]) == ([0.5, 1.5, None], [1.0, 2.5])
            serialized = io.BytesIO()
            LaserScan(ranges=[7.0]).serialize(serialized)
            raw = {"op": "publish", "topic": "/in_cbor", "compression": "cbor-raw", "msg": {"bytes": serialized.getvalue()}}
            await speaker.raw(cbor2.dumps(raw))
            assert (await listener.receive("publish"))["msg"]["ranges"] == [7.0]

    asyncio.run(story())


def test_throttled_subscribers_get_the_first_and_with_a_queue_the_newest_in_order(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            queued, plain, speaker = await clients.new(), await clients.new(), await clients.new()
            for socket, length in ((queued, 2), (plain, 0)):
                wish = {"throttle_rate": 1000, "queue_length": length, "type": "std_msgs/String"}
                await socket.send(op="subscribe", topic="/throttled", **wish)
                await socket.settle()
            await speaker.send(op="advertise", topic="/throttled", type="std_msgs/String")
            for number in range(10):
                await speaker.send(op="publish", topic="/throttled", msg={"data": str(number)})
            assert [(await queued.receive("publish"))["msg"]["data"] for _ in range(3)] == ["0", "8", "9"]
            assert (await plain.receive("publish"))["msg"]["data"] == "0"
            await speaker.send(op="publish", topic="/throttled", msg={"data": "later"})
            assert (await plain.receive("publish"))["msg"]["data"] == "later"

    asyncio.run(story())


@pytest.mark.parametrize(
    "change",
    [{"op": "unsubscribe"}, {"op": "subscribe", "type": "std_msgs/String"}],
    ids=["unsubscribed", "changed"],
)
def test_what_a_throttled_subscription_holds_does_not_outlive_it(clients: Clients, change: dict[str, str]) -> None:
    async def story() -> None:
        async with clients:
            listener, speaker = await clients.new(), await clients.new()
            wish = {"throttle_rate": 300, "queue_length": 10, "type": "std_msgs/String"}
            await listener.send(op="subscribe", topic="/held_back", **wish)
            await listener.settle()
            await speaker.send(op="advertise", topic="/held_back", type="std_msgs/String")
            for number in range(10):
                await speaker.send(op="publish", topic="/held_back", msg={"data": str(number)})
            assert (await listener.receive("publish"))["msg"]["data"] == "0"  # the others are on their way, or held
            assert (await listener.receive("publish"))["msg"]["data"] == "1"
            await listener.send(topic="/held_back", **change)
            await listener.settle()
            await asyncio.sleep(1)  # in which three more were due
            await listener.send(op="settle")
            assert json.loads(await listener.connection.read_message() or "")["op"] == "status"

    asyncio.run(story())


def test_a_mistyped_subscription_is_told_to_all_and_gives_way_to_the_right_one(clients: Clients, ros_env: dict[str, str]) -> None:
    wrong, right = {"type": "std_msgs/String"}, {"type": "std_msgs/Int32"}

    async def story(node: Puppet) -> None:
        async with clients:
            mistaken = [await clients.new() for _ in range(3)]
            await mistaken[0].send(op="subscribe", topic="/mistyped", **wrong)
            await mistaken[0].settle()
            node.do("publisher = rospy.Publisher('/mistyped', Int32, latch=True, queue_size=1)")
            node.do("publisher.publish(7)")
            for socket, wish in zip(mistaken, (None, wrong, {}), strict=True):
                if wish is not None:
                    await socket.send(op="subscribe", topic="/mistyped", **wish)
                assert "cannot get the messages of /mistyped" in (await socket.receive("status"))["msg"]
            other = await clients.new()
            await other.send(op="subscribe", topic="/mistyped", **right)
            assert "it is std_msgs/String" in (await other.receive("status"))["msg"]
            for socket in mistaken:
                await socket.send(op="unsubscribe", topic="/mistyped")
                await socket.settle()
            await other.send(op="subscribe", topic="/mistyped", **right)
            assert (await other.receive("publish"))["msg"] == {"data": 7}

    with puppet(ros_env, "typed") as typed:
        asyncio.run(story(typed))
