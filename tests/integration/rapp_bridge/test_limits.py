"""What one client may have and do at once: more is answered with what the limit is, and others are served."""

import asyncio
import signal
from pathlib import Path
from typing import Any

import pytest

from fakes.bridge_neighbours import PATIENCE, Peer
from fakes.bridge_puppet import Puppet, puppet
from fakes.bridge_wire import BINARY, TurnedAwayError, Wire, framed

NAMES, CALLS, REQUESTS, CLIENTS, RATE, QUEUE, FRAME = 5, 8, 3, 12, 3000, 300_000, 50_000
LOOPBACK = "0100007F"


@pytest.fixture(scope="module")
def bridge(start_for_module: Any, peer: Peer) -> Any:
    limits = {
        "names": NAMES, "calls": CALLS, "requests": REQUESTS, "clients": CLIENTS, "frame-rate": RATE, "queue-limit": QUEUE,
        "frame-limit": FRAME, "linger": 0.5,
    }  # fmt: skip
    return start_for_module(
        "rapp_bridge", "--port", "0", *(str(word) for pair in limits.items() for word in (f"--{pair[0]}", pair[1]))
    )


async def served(url: str) -> None:
    wire = await Wire.open(url)
    wire.send(op="call_service", service="/say", args=["as ever"])
    assert (await wire.receive("service_response"))["values"]["message"] == "as ever"
    wire.leave()


@pytest.mark.parametrize(
    "fields",
    [
        {"op": "subscribe", "topic": "/n{}", "type": "std_msgs/String"},
        {"op": "subscribe", "topic": "/n", "type": "std_msgs/String", "id": "{}"},
        {"op": "advertise", "topic": "/n{}", "type": "std_msgs/String"},
        {"op": "advertise_service", "service": "/n{}", "type": "std_srvs/Empty"},
    ],
    ids=["subscriptions", "subscriptions-of-one-topic", "advertisements", "services"],
)
def test_names_that_a_client_holds(url: str, fields: dict[str, str]) -> None:
    async def story() -> None:
        wire = await Wire.open(url)
        for number in range(NAMES + 1):
            wire.send(**{name: value.format(number) for name, value in fields.items()})
        assert f"this client holds {NAMES} topics and services" in (await wire.receive("status"))["msg"]
        first = {name: value.format(0) for name, value in fields.items()}
        wire.send(**{**first, "op": {"subscribe": "unsubscribe"}.get(first["op"], f"un{first['op']}")})
        wire.send(op="subscribe", topic="/latched", type="std_msgs/String")
        assert (await wire.receive("publish"))["msg"] == {"data": "kept"}  # there is room again
        wire.leave()
        await served(url)

    asyncio.run(story())


def test_calls_that_a_client_has_open_and_that_wait_for_a_service(url: str) -> None:
    async def story() -> None:
        provider, caller = await Wire.open(url), await Wire.open(url)
        for number in range(3):
            provider.send(op="advertise_service", service=f"/silent{number}", type="std_srvs/Empty")
        await provider.settle()
        for number in range(CALLS + 2):
            caller.send(op="call_service", service=f"/silent{number // (REQUESTS + 1)}", id=number, timeout=15)
        answers = [await caller.receive("service_response") for _ in range(2)]
        assert answers[0]["id"] == REQUESTS
        assert f"{REQUESTS} calls wait for it" in answers[0]["values"]
        assert f"{REQUESTS} calls wait for it" in answers[1]["values"]
        for number in range(CALLS):
            caller.send(op="call_service", service="/silent2", id=f"more{number}", timeout=15)
        texts = [(await caller.receive("service_response"))["values"] for _ in range(CALLS - 1)]
        assert f"{CALLS} calls are open" in texts[-1]
        provider.leave()
        caller.leave()
        await served(url)

    asyncio.run(story())


def test_connections(url: str) -> None:
    async def story() -> None:
        wires: list[Wire] = []
        with pytest.raises(TurnedAwayError, match="503") as caught:
            for _ in range(CLIENTS + 1):
                wires.append(await Wire.open(url))
        assert "cannot serve more clients" in str(caught.value)
        wires[0].send(op="call_service", service="/say", args=["as ever"])
        assert (await wires[0].receive("service_response"))["values"]["message"] == "as ever"
        for wire in wires:
            wire.leave()
        async with asyncio.timeout(PATIENCE):
            while not await has_room(url):
                await asyncio.sleep(0.05)

    asyncio.run(story())


async def has_room(url: str) -> bool:
    try:
        (await Wire.open(url)).leave()
    except TurnedAwayError:
        return False
    return True


def test_messages_in_a_second(url: str) -> None:
    async def story() -> None:
        wire = await Wire.open(url)
        wire.raw(framed(b'{"op":"set_level","level":"error"}') * 20 * RATE)
        code, reason, said = await wire.ending()
        text = f"cannot serve more than {RATE} messages a second; send fewer"
        assert (code, reason, said[-1]) == (1008, text, text)  # though more was on its way
        wire.leave()
        await served(url)

    asyncio.run(story())


@pytest.mark.parametrize("opcode", [1, BINARY])
def test_the_size_of_a_message(url: str, opcode: int) -> None:
    async def story() -> None:
        wire = await Wire.open(url)
        wire.raw(framed(b"x" * (FRAME + 1), opcode)[:20])  # its head is enough
        code, reason, said = await wire.ending()
        text = f"cannot take a message of {FRAME + 1} bytes; {FRAME} is the limit"
        assert (code, reason, said) == (1009, text, [text])
        wire.leave()
        await served(url)

    asyncio.run(story())


@pytest.mark.parametrize(
    ("sent", "why"),
    [
        (framed(b'{"op":"publish","topic":"/n","msg":' + b"[" * 2000 + b"]" * 2000 + b"}"), "depth limit"),
        (framed(b"\xa1\x61a" + b"\x81" * 2000 + b"\x00", BINARY), "depth"),
    ],
    ids=["json", "cbor"],
)
def test_the_nesting_of_a_message(url: str, sent: bytes, why: str) -> None:
    async def story() -> None:
        wire = await Wire.open(url)
        wire.raw(sent)
        assert why in (await wire.receive("status"))["msg"].lower()
        await wire.settle()
        wire.leave()

    asyncio.run(story())


def test_bytes_of_unfinished_messages(url: str) -> None:
    async def story() -> None:
        wire = await Wire.open(url)
        for number in range(2):
            wire.send(op="fragment", id=number, num=0, total=2, data="x" * (FRAME * 3 // 4))
        assert f"cannot keep more than {FRAME} characters" in (await wire.receive("status"))["msg"]
        wire.leave()

    asyncio.run(story())


def test_bytes_of_answers_that_wait_for_a_client_that_does_not_read(url: str, bridge: Any) -> None:
    async def story() -> None:
        wire = await Wire.open(url)
        transport: Any = wire.writer.transport
        transport.pause_reading()
        while "more than 300000 bytes" not in Path(f"/proc/{bridge.process.pid}/fd/2").read_text():  # its log
            wire.send(op="dance", id="x" * 20_000)  # which comes back with the status
            await asyncio.sleep(0.001)
        transport.resume_reading()
        code, reason, _ = await wire.ending()
        assert (code, reason) == (1008, f"cannot keep more than {QUEUE} bytes of answers for you; read faster, or ask less")
        wire.leave()
        await served(url)

    asyncio.run(asyncio.wait_for(story(), 60))


def test_topic_messages_that_wait_are_the_newest_and_the_client_may_know(url: str) -> None:
    async def story() -> None:
        slow, speaker = await Wire.open(url), await Wire.open(url)
        slow.send(op="set_level", level="warning")
        slow.send(op="subscribe", topic="/flood", type="std_msgs/String")
        await slow.settle()
        transport: Any = slow.writer.transport
        transport.pause_reading()
        speaker.send(op="advertise", topic="/flood", type="std_msgs/String")
        for number in range(600):
            speaker.send(op="publish", topic="/flood", msg={"data": f"{number:05}" + "x" * 20_000})
            if number % 20 == 0:
                await speaker.settle()
        await speaker.settle()
        transport.resume_reading()
        numbers, warned = [], False
        while not numbers or numbers[-1] != 599:
            message = await slow.receive_any()
            if message["op"] == "publish":
                numbers.append(int(message["msg"]["data"][:5]))
            warned = warned or "the oldest are dropped" in message.get("msg", "")
        assert numbers == sorted(numbers)
        assert len(numbers) < 600
        assert warned
        slow.leave()
        speaker.leave()

    asyncio.run(story())


def test_bytes_that_wait_for_a_node_that_stands_still(url: str, ros_env: dict[str, str]) -> None:
    """However many messages its publisher would keep."""

    async def story(still: Puppet) -> None:
        wire = await Wire.open(url)
        wire.send(op="set_level", level="warning")
        wire.send(op="advertise", topic="/still", type="std_msgs/String", queue_size=1_000_000)
        await wire.settle()
        while not still.do("subscriber.get_num_connections()"):
            await asyncio.sleep(0.02)
        still.process.send_signal(signal.SIGSTOP)
        for number in range(1000):  # more than the system keeps
            wire.send(op="publish", topic="/still", msg={"data": f"{number} " + "x" * (FRAME // 2)})
        assert "messages of /still for /still: it reads too slowly" in (await wire.receive("status"))["msg"]
        await wire.settle()
        still.process.send_signal(signal.SIGCONT)
        while still.do("heard[-1:]") != ["999"]:
            await asyncio.sleep(0.02)
        assert still.do("heard[0]") == "0"
        assert still.do("len(heard)") < 1000
        wire.leave()

    with puppet(ros_env, "still") as node:
        node.do("heard = []")
        node.do("subscriber = rospy.Subscriber('/still', String, lambda m: heard.append(m.data.split()[0]))")
        asyncio.run(story(node))


def test_bytes_of_messages_that_wait_for_the_ros_master(start: Any, own_master: Any) -> None:
    """They are not lost: the client is not read from until there is room again."""
    bridge = start("rapp_bridge", "--port", "0", "--frame-limit", str(20 * FRAME), env=own_master.env)

    async def story() -> None:
        wire = await Wire.open(f"ws://127.0.0.1:{bridge.ready['port']}")
        transport: Any = wire.writer.transport
        own_master.signal(signal.SIGSTOP)
        wire.send(op="advertise", topic="/waiting", type="std_msgs/String")
        for _ in range(1000):
            wire.send(op="publish", topic="/waiting", msg={"data": "x" * FRAME})
        left = [0]
        while not left[:-1] or left[-1] != left[-2]:
            await asyncio.sleep(0.5)
            left.append(transport.get_write_buffer_size())
        assert left[-1] > 500 * FRAME, "50 MB were sent, of which 1 MB may wait beside what the system keeps"
        own_master.signal(signal.SIGCONT)
        await wire.settle()
        assert transport.get_write_buffer_size() == 0
        wire.leave()

    asyncio.run(story())


def test_without_being_told_so_the_bridge_listens_on_loopback_only(bridge: Any) -> None:
    port = f"{bridge.ready['port']:04X}"
    rows = [line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]]
    listening = [row[1].split(":")[0] for row in rows if row[3] == "0A" and row[1].endswith(f":{port}")]
    assert listening == [LOOPBACK]
