"""Where upstream is wrong, ours is right: one test for each of its users' complaints."""

import asyncio
import json
import os
import signal
import time
from typing import Any

import pytest

from fakes.bridge_neighbours import Clients, Peer, Socket, node
from fakes.bridge_wire import Wire

LONG = "0123456789" * 100


async def listening(clients: Clients, topic: str, kind: str, **more: Any) -> Socket:
    socket = await clients.new()
    await socket.send(op="subscribe", topic=topic, type=kind, **more)
    await socket.settle()
    return socket


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"op": "dance"}, "cannot serve op 'dance'"),
        ({"op": "publish", "topic": "/told", "msg": {"data": 3}}, "a string is needed"),
        ({"op": "publish", "topic": "/unheard_of", "msg": {}}, "nobody publishes or subscribes it"),
        ({"op": "subscribe", "topic": "/told", "type": "std_msgs/Int32"}, "it is std_msgs/String"),
        ({"op": "subscribe", "topic": "/unheard_of"}, "nobody publishes or subscribes it"),
        ({"op": "advertise", "topic": "/told", "type": "std_msgs/Int32"}, "it is std_msgs/String"),
        ({"op": "advertise", "topic": "/told", "type": "no_msgs/Such"}, "no_msgs"),
        ({"op": "unadvertise", "topic": "/never"}, "does not advertise it"),
        ({"op": "unsubscribe", "topic": "/never"}, "not subscribed"),
    ],
)
def test_errors_are_not_silent(clients: Clients, fields: dict[str, Any], why: str) -> None:
    async def story() -> None:
        async with clients:
            socket = await listening(clients, "/told", "std_msgs/String")
            await socket.send(**fields, id="mine")
            status = await socket.receive("status")
            assert (status["level"], status["id"]) == ("error", "mine")
            assert why in status["msg"]

    asyncio.run(story())


def test_set_level_chooses_what_is_told(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            socket = await clients.new()
            await socket.send(op="set_level", level="none")
            await socket.send(op="dance", id="unheard")
            await socket.send(op="set_level", level="error")
            await socket.send(op="dance", id="heard")
            assert (await socket.receive("status"))["id"] == "heard"

    asyncio.run(story())


def test_a_header_that_is_left_out_is_stamped_now_and_one_that_is_given_is_kept(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            listener, speaker = await listening(clients, "/stamped", "sensor_msgs/Range"), await clients.new()
            await speaker.send(op="advertise", topic="/stamped", type="sensor_msgs/Range")
            before = time.time()
            for msg in ({}, {"header": {"frame_id": "f"}}, {"header": {"stamp": {"secs": 7, "nsecs": 9}}}):
                await speaker.send(op="publish", topic="/stamped", msg=msg)
            left_out, without, given = [(await listener.receive("publish"))["msg"]["header"] for _ in range(3)]
            for header in (left_out, without):
                assert before - 1 <= header["stamp"]["secs"] <= time.time()
            assert without["frame_id"] == "f"
            assert given["stamp"] == {"secs": 7, "nsecs": 9}

    asyncio.run(story())


def test_fragments_come_in_any_order_and_those_of_two_clients_do_not_mix(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            listener = await listening(clients, "/in_parts", "std_msgs/String")
            speakers: list[tuple[Socket, list[str]]] = []
            for name in "ab":
                speaker = await clients.new()
                await speaker.send(op="advertise", topic="/in_parts", type="std_msgs/String")
                await speaker.settle()
                text = json.dumps({"op": "publish", "topic": "/in_parts", "msg": {"data": name + LONG}})
                speakers.append((speaker, [text[start : start + 100] for start in range(0, len(text), 100)]))
            for number in reversed(range(len(speakers[0][1]))):
                for speaker, parts in speakers:
                    await speaker.send(op="fragment", id="same", num=number, total=len(parts), data=parts[number])
            assert {(await listener.receive("publish"))["msg"]["data"] for _ in range(2)} == {f"a{LONG}", f"b{LONG}"}

    asyncio.run(story())


def test_fragments_sent_have_whole_totals_and_ids_of_their_own(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            listener = await listening(clients, "/in_pieces", "std_msgs/String", fragment_size=100)
            speaker = await clients.new()
            await speaker.send(op="advertise", topic="/in_pieces", type="std_msgs/String")
            for _ in range(2):
                await speaker.send(op="publish", topic="/in_pieces", msg={"data": LONG})
            first = await listener.receive("fragment")
            assert type(first["total"]) is int
            parts = [first, *[await listener.receive("fragment") for _ in range(2 * first["total"] - 1)]]
            names = {part["id"] for part in parts}
            assert len(names) == 2
            assert all(isinstance(name, str) and name for name in names)
            for name in names:
                own = {part["num"]: part["data"] for part in parts if part["id"] == name}
                text = "".join(own[number] for number in range(first["total"]))
                assert json.loads(text) == {"op": "publish", "topic": "/in_pieces", "msg": {"data": LONG}}

    asyncio.run(story())


def test_a_service_does_not_outlive_its_provider_and_its_callers_are_told(clients: Clients, peer: Peer) -> None:
    async def story() -> None:
        async with clients:
            provider, caller = await clients.new(), await clients.new()
            await provider.send(op="advertise_service", service="/mortal_service", type="rapp_msgs/Say")
            await provider.settle()
            peer.call("/mortal_service", "from ROS")
            await provider.receive("call_service")
            provider.leave()
            assert "its provider has left" in await peer.heard()
            while (await caller.call("/rosapi/service_node", args=["/mortal_service"]))["values"]["node"]:
                await asyncio.sleep(0.02)
            peer.call("/mortal_service", "anybody")
            assert "unavailable" in await peer.heard()

    asyncio.run(story())


def test_no_caller_waits_for_ever_and_rosapi_does_not_hang_on_a_frozen_node(clients: Clients, ros_env: dict[str, str]) -> None:
    async def story() -> None:
        async with clients:
            socket = await clients.new()
            with node({**ros_env, "ROS_NAMESPACE": "/cold"}, "frozen") as cold:
                os.kill(cold.process.pid, signal.SIGSTOP)
                answer = await socket.call("/cold/say", args=["hello"], timeout=1)
                assert (answer["result"], "cannot" in answer["values"]) == (False, True)
                found = await socket.call("/rosapi/services_for_type", args=["rapp_msgs/Say"])
                assert found["values"]["services"] == ["/say"]
                assert (await socket.call("/rosapi/service_type", args=["/cold/say"]))["values"] == {"type": ""}
                os.kill(cold.process.pid, signal.SIGCONT)

    asyncio.run(story())


@pytest.mark.parametrize(
    "field", [{"fragment_size": "x"}, {"png": 1}, {"message_intervall": "x"}, {"id": [1]}, {"fragment_size": [[]]}]
)
def test_a_malformed_field_deafens_no_connection(clients: Clients, peer: Peer, field: dict[str, Any]) -> None:
    async def story() -> None:
        async with clients:
            socket = await clients.new()
            await socket.send(op="subscribe", topic="/latched", type="std_msgs/String", **field)
            answer = await socket.call("/say", args=["heard"])
            assert answer["values"]["message"] == "heard"

    asyncio.run(story())


def test_one_topic_goes_raw_to_one_client_and_decoded_to_another(url: str, clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            raw = await Wire.open(url)
            raw.send(op="subscribe", topic="/mixed", type="std_msgs/String", compression="cbor-raw")
            await raw.settle()
            plain, speaker = await listening(clients, "/mixed", "std_msgs/String"), await clients.new()
            await speaker.send(op="advertise", topic="/mixed", type="std_msgs/String")
            await speaker.send(op="publish", topic="/mixed", msg={"data": "both"})
            assert (await plain.receive("publish"))["msg"] == {"data": "both"}
            found = await raw.frame()
            assert found is not None
            assert found[1].endswith(b"\x04\0\0\0both")
            raw.leave()

    asyncio.run(story())


def test_two_spellings_of_a_topic_are_two_subscriptions(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            socket = await listening(clients, "/spelt", "std_msgs/String")
            await socket.send(op="subscribe", topic="spelt", type="std_msgs/String")
            await socket.send(op="advertise", topic="spelt", type="std_msgs/String")
            await socket.send(op="publish", topic="spelt", msg={"data": "a"})
            assert {(await socket.receive("publish"))["topic"] for _ in range(2)} == {"/spelt", "spelt"}
            await socket.send(op="unsubscribe", topic="spelt")
            await socket.send(op="publish", topic="spelt", msg={"data": "b"})
            assert await socket.receive("publish") == {"op": "publish", "topic": "/spelt", "msg": {"data": "b"}}

    asyncio.run(story())


def test_what_the_bridge_writes_for_nan_it_takes_back(clients: Clients) -> None:
    async def story() -> None:
        async with clients:
            listener, speaker = await listening(clients, "/not_numbers", "std_msgs/Float64"), await clients.new()
            await speaker.send(op="advertise", topic="/not_numbers", type="std_msgs/Float64")
            await speaker.send(op="publish", topic="/not_numbers", msg={"data": None})
            assert (await listener.receive("publish"))["msg"] == {"data": None}

    asyncio.run(story())
