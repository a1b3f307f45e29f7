"""The bridge with a real ROS master, a real rospy node, and roslibpy and bare WebSocket clients."""

import asyncio
import json
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tornado.websocket import WebSocketClientConnection, websocket_connect

NODE = """
import sys, time, rospy
from std_srvs.srv import SetBool, SetBoolResponse
from rapp_msgs.srv import Say, SayResponse
from std_msgs.msg import String, UInt8MultiArray
rospy.init_node("peer", disable_signals=True)
def say(request):
    if request.text == "slow": time.sleep(3)
    if request.text == "fail": raise ValueError("no voice")
    return SayResponse(True, request.text)
rospy.Service("say", Say, say)
latched = rospy.Publisher("latched", String, latch=True, queue_size=1); latched.publish("kept")
echo = rospy.Publisher("echoed", String, queue_size=100)
rospy.Subscriber("to_echo", String, echo.publish)
print("READY {}", flush=True)
import json
for line in sys.stdin:   # calls of services that clients offer, on request
    name, text = json.loads(line)
    try: print(json.dumps(rospy.ServiceProxy(name, Say)(text, "").message), flush=True)
    except rospy.ServiceException as error: print(json.dumps("error: %s" % error), flush=True)
"""


class Peer:
    """A rospy node in a process of its own."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.heard()

    def call(self, service: str, text: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps([service, text]) + "\n")
        self.process.stdin.flush()

    def heard(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()


@pytest.fixture
def peer(ros_env: dict[str, str]) -> Iterator[Peer]:
    process = subprocess.Popen([sys.executable, "-c", NODE], env=ros_env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    yield Peer(process)
    process.kill()
    process.communicate()


@pytest.fixture
def url(start: Callable[..., Any], peer: Peer) -> str:
    return f"ws://127.0.0.1:{start('rapp_bridge', '--port', '0', '--call-timeout', '20').ready['port']}"


async def send(socket: WebSocketClientConnection, **fields: Any) -> None:
    await socket.write_message(json.dumps(fields))


async def receive(socket: WebSocketClientConnection, op: str) -> dict[str, Any]:
    async with asyncio.timeout(15):
        while True:
            text = await socket.read_message()
            assert text is not None, "the bridge closed the connection"
            message: dict[str, Any] = json.loads(text)
            if message["op"] == op:
                return message


def test_one_slow_call_of_a_client_delays_none_of_its_fifty_others(url: str) -> None:
    async def story() -> list[str]:
        socket = await websocket_connect(url)
        await send(socket, op="call_service", id="slow", service="/say", args={"text": "slow"})
        for number in range(50):
            await send(socket, op="call_service", id=f"c{number}", service="/say", args=[f"text {number}"])
        answers = [await receive(socket, "service_response") for _ in range(51)]
        assert all(a["result"] for a in answers), answers
        assert {a["values"]["message"] for a in answers} == {"slow", *(f"text {n}" for n in range(50))}
        return [a["id"] for a in answers]

    assert asyncio.run(story())[-1] == "slow"


def test_failures_of_a_call_are_answers_with_result_false(url: str) -> None:
    async def story() -> dict[str, dict[str, Any]]:
        socket = await websocket_connect(url)
        await send(socket, op="call_service", id="fails", service="/say", args={"text": "fail"})
        await send(socket, op="call_service", id="unknown", service="/nowhere")
        await send(socket, op="call_service", id="wrong", service="/say", args={"volume": 1})
        await send(socket, op="call_service", id="late", service="/say", args={"text": "slow"}, timeout=0.3)
        return {a["id"]: a for a in [await receive(socket, "service_response") for _ in range(4)]}

    answers = asyncio.run(story())
    assert not any(a["result"] for a in answers.values())
    assert "no voice" in answers["fails"]["values"]
    assert "no such service" in answers["unknown"]["values"]
    assert "no field volume" in answers["wrong"]["values"]
    assert "no answer in 0.3 s" in answers["late"]["values"]


@pytest.mark.parametrize(
    "frame",
    ["", "[]", "{", '"publish"', "{}", '{"op": 3}', '{"op": "dance"}', '{"op": "publish"}', '{"op":"publish","topic":"/x","msg":{}} ]',
     '{"op":"subscribe","topic":"/echoed","throttle_rate":-1}', '{"op":"advertise","topic":"/y","type":"no_msgs/None"}',
     '{"op":"service_response","service":"/say","id":"1","result":true}'],
)  # fmt: skip
def test_a_bad_frame_is_told_and_harms_nothing(url: str, frame: str) -> None:
    async def story() -> tuple[dict[str, Any], dict[str, Any]]:
        socket = await websocket_connect(url)
        await socket.write_message(frame)
        status = await receive(socket, "status")
        await send(socket, op="call_service", id="next", service="/say", args=["still here"])
        return status, await receive(socket, "service_response")

    status, answer = asyncio.run(story())
    assert status["level"] == "error"
    assert status["msg"].startswith("cannot ")
    assert answer["values"]["message"] == "still here"


def test_topics_flow_both_ways_and_latched_messages_reach_the_second_subscriber(url: str) -> None:
    async def story() -> None:
        first, second = await websocket_connect(url), await websocket_connect(url)
        for socket in (first, second):
            await send(socket, op="subscribe", topic="/latched", type="std_msgs/String")
            assert (await receive(socket, "publish"))["msg"] == {"data": "kept"}
        await send(first, op="subscribe", topic="/echoed", type="std_msgs/String", id="s1")
        await send(second, op="advertise", topic="/to_echo", type="std_msgs/String")
        heard = asyncio.create_task(receive(first, "publish"))
        while not heard.done():
            await send(second, op="publish", topic="/to_echo", msg={"data": "hello"})
            await asyncio.wait({heard}, timeout=0.1)
        assert heard.result()["msg"] == {"data": "hello"}

    asyncio.run(story())


def test_callers_of_a_provider_that_leaves_are_told_at_once(url: str, peer: Peer) -> None:
    async def story() -> str:
        provider = await websocket_connect(url)
        await send(provider, op="advertise_service", service="/offered", type="rapp_msgs/Say")
        await send(provider, op="call_service", id="settled", service="/say", args=["settled"])
        await receive(provider, "service_response")
        peer.call("/offered", "one")
        request = await receive(provider, "call_service")
        await send(provider, op="service_response", service="/offered", id=request["id"], result=True, values={"success": True, "message": "yes"})
        assert await asyncio.to_thread(peer.heard) == '"yes"'
        peer.call("/offered", "two")
        await receive(provider, "call_service")
        provider.close()
        began = time.monotonic()
        heard = await asyncio.to_thread(peer.heard)
        assert time.monotonic() - began < 10, "the call ended by its time-out, not because its provider left"
        return heard

    assert asyncio.run(story()).startswith('"error')


def test_a_client_that_never_reads_slows_no_other(url: str) -> None:
    async def story() -> None:
        lazy, lively = await websocket_connect(url), await websocket_connect(url)
        await send(lazy, op="subscribe", topic="/flood", type="std_msgs/String")
        await send(lively, op="advertise", topic="/flood", type="std_msgs/String")
        for _ in range(300):
            await send(lively, op="publish", topic="/flood", msg={"data": "x" * 100_000})
        await send(lively, op="call_service", id="after", service="/say", args=["lively"])
        assert (await receive(lively, "service_response"))["values"]["message"] == "lively"

    asyncio.run(story())


def test_roslibpy_calls_offers_publishes_and_subscribes(url: str, peer: Peer, ros_env: dict[str, str], tmp_path: Path) -> None:
    program = textwrap.dedent(
        """
        import sys, threading, roslibpy
        host, port = sys.argv[1].removeprefix("ws://").split(":")
        ros = roslibpy.Ros(host, int(port)); ros.run(timeout=10)
        offered = roslibpy.Service(ros, "/from_roslibpy", "rapp_msgs/Say")
        def answer(request, response):
            response["success"] = True; response["message"] = request["text"].upper(); return True
        offered.advertise(answer)
        got = threading.Event()
        topic = roslibpy.Topic(ros, "/latched", "std_msgs/String"); topic.subscribe(lambda m: got.set() if m["data"] == "kept" else None)
        say = roslibpy.Service(ros, "/say", "rapp_msgs/Say")
        assert say.call(roslibpy.ServiceRequest({"text": "hi"}), timeout=10)["message"] == "hi"
        assert got.wait(10)
        print("offering", flush=True); sys.stdin.readline(); ros.terminate()
        """
    )
    client = subprocess.Popen([sys.executable, "-c", program, url], env=ros_env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert client.stdout is not None
    try:
        assert client.stdout.readline().strip() == "offering"
        peer.call("/from_roslibpy", "loud")
        assert peer.heard() == '"LOUD"'
        client.communicate("end\n", timeout=10)
        assert client.returncode == 0
    finally:
        client.kill()
        client.communicate()
