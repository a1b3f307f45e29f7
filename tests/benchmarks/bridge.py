"""What the bridge costs: service calls through it beside bare persistent ServiceProxy calls of the same run, and topic rates.

    ./rapp bench bridge [--rounds N]

Starts a ROS master, a node and the bridge on free ports of this machine, measures about ten seconds, ends them all.
Bare and bridged calls take turns, so that a busy machine slows both; judge the ratio, not the microseconds.
"""

import argparse
import asyncio
import json
import os
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import rospy
from std_srvs.srv import SetBool
from tornado.websocket import WebSocketClientConnection, websocket_connect

ROUND = 0.4  # s, of each kind of call in one round
FLOOD = 5000  # messages of a topic measurement
FLIGHT = 32  # calls in flight at once
PATIENCE = 20.0  # s until a process or an answer counts as missing

NODE = """
import sys, rospy
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool, SetBoolResponse
rospy.init_node("bench_node", disable_signals=True, disable_rosout=True)
out = rospy.Publisher("bench_out", String, queue_size=10000)
heard = rospy.Publisher("bench_heard", Int32, queue_size=10)
count = 0
def hear(message):
    global count
    count += 1
    if message.data == "last": heard.publish(count); count = 0
def flood(request):
    text = "x" * 32
    for _ in range(int(sys.argv[1])): out.publish(text)
    return SetBoolResponse(True, "")
rospy.Service("bench_call", SetBool, lambda request: SetBoolResponse(request.data, "x"))
rospy.Service("bench_flood", SetBool, flood)
rospy.Subscriber("bench_in", String, hear, tcp_nodelay=True)
print("READY", flush=True)
rospy.spin()
"""


@contextmanager
def child(words: list[str], env: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    """A process that is ended, and killed when it does not end."""
    process = subprocess.Popen(words, env=env, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        assert process.stdout is not None
        process.stdout.close()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for_port(port: int) -> None:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    raise SystemExit("cannot start: the ROS master does not come up")


def ready_line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line.startswith("READY"):
        raise SystemExit(f"cannot start {process.args}")
    return line


def cpu(pid: int) -> float:
    """Processor seconds a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def receive(client: WebSocketClientConnection, op: str) -> dict[str, Any]:
    async with asyncio.timeout(PATIENCE):
        while True:
            text = await client.read_message()
            if text is None:
                raise SystemExit("cannot go on: the bridge closed the connection")
            message: dict[str, Any] = json.loads(text)
            if message["op"] == op:
                return message


async def bridged_calls(client: WebSocketClientConnection) -> list[float]:
    """Seconds of each call, one after another."""
    took = []
    end = time.perf_counter() + ROUND
    while (began := time.perf_counter()) < end:
        await client.write_message('{"op":"call_service","id":"1","service":"/bench_call","args":{"data":true}}')
        answer = await receive(client, "service_response")
        took.append(time.perf_counter() - began)
        if answer["values"] != {"success": True, "message": "x"}:
            raise SystemExit(f"cannot go on: the bridge answers {answer}")
    return took


def bare_calls(proxy: Any) -> list[float]:
    """Seconds of each call, one after another."""
    took = []
    end = time.perf_counter() + ROUND
    while (began := time.perf_counter()) < end:
        if not proxy(True).success:
            raise SystemExit("cannot go on: the service answers wrongly")
        took.append(time.perf_counter() - began)
    return took


async def calls_in_flight(client: WebSocketClientConnection, seconds: float) -> float:
    """Answers per second with many calls open at once."""
    call = '{"op":"call_service","id":"1","service":"/bench_call","args":{"data":true}}'
    for _ in range(FLIGHT):
        await client.write_message(call)
    began, count = time.perf_counter(), 0
    while time.perf_counter() < began + seconds:
        await receive(client, "service_response")
        await client.write_message(call)
        count += 1
    rate = count / (time.perf_counter() - began)
    for _ in range(FLIGHT):
        await receive(client, "service_response")
    return rate


async def topic_to_client(client: WebSocketClientConnection) -> tuple[float, int]:
    """Messages per second from a node's flood to a client, and how many of it came."""
    wish = {"op": "subscribe", "topic": "/bench_out", "type": "std_msgs/String", "queue_length": FLOOD}
    await client.write_message(json.dumps(wish))
    await asyncio.sleep(0.5)  # rospy connects
    await client.write_message('{"op":"call_service","service":"/bench_flood","args":[true]}')
    began = await first_of_flood(client)
    count = 1
    while count < FLOOD:
        await receive(client, "publish")
        count += 1
    return (count - 1) / (time.perf_counter() - began), count


async def first_of_flood(client: WebSocketClientConnection) -> float:
    await receive(client, "publish")
    return time.perf_counter()


async def topic_to_ros(client: WebSocketClientConnection) -> tuple[float, int]:
    """Messages per second from a client to a node, and how many of the flood came."""
    await client.write_message('{"op":"subscribe","topic":"/bench_heard","type":"std_msgs/Int32"}')
    advertise = {"op": "advertise", "topic": "/bench_in", "type": "std_msgs/String", "queue_size": FLOOD}
    await client.write_message(json.dumps(advertise))
    await asyncio.sleep(1.5)  # rospy connects, and the topic's opening ends
    text = json.dumps({"op": "publish", "topic": "/bench_in", "msg": {"data": "x" * 32}})
    began = time.perf_counter()
    for _ in range(FLOOD - 1):
        await client.write_message(text)
    await client.write_message('{"op":"publish","topic":"/bench_in","msg":{"data":"last"}}')
    while (heard := await receive(client, "publish"))["topic"] != "/bench_heard":
        pass
    return FLOOD / (time.perf_counter() - began), int(heard["msg"]["data"])


def row(name: str, *values: str) -> None:
    print(f"{name:<46}" + "".join(f"{value:>14}" for value in values))


def timings(name: str, took: list[float]) -> None:
    micros = sorted(seconds * 1e6 for seconds in took)
    row(name, f"{statistics.median(micros):.0f}", f"{micros[int(len(micros) * 0.99)]:.0f}", f"{len(took)}")


async def measure(port: int, pid: int, rounds: int) -> None:
    client = await websocket_connect(f"ws://127.0.0.1:{port}")
    proxy = rospy.ServiceProxy("bench_call", SetBool, persistent=True)
    bare_calls(proxy)
    await bridged_calls(client)
    bare, bridged, used, ratios = [], [], 0.0, []
    for _ in range(rounds):
        bare_round = bare_calls(proxy)
        before = cpu(pid)
        bridged_round = await bridged_calls(client)
        used += cpu(pid) - before
        ratios.append(statistics.median(bridged_round) / statistics.median(bare_round))
        bare += bare_round
        bridged += bridged_round
    row("service call, one at a time", "median us", "p99 us", "calls")
    timings("  bare rospy ServiceProxy, persistent", bare)
    timings("  through the bridge", bridged)
    row("  bridged : bare (median of rounds)", f"{statistics.median(ratios):.2f}")
    row("  processor time of the bridge per call, us", f"{used / len(bridged) * 1e6:.0f}")
    rate = await calls_in_flight(client, 1.5)
    row(f"service calls, {FLIGHT} in flight", "per s")
    row("  through the bridge", f"{rate:.0f}")
    row("topic, 32-byte strings", "per s", "came", "CPU us each")
    for name, flood in (("  node to client", topic_to_client), ("  client to node", topic_to_ros)):
        before = cpu(pid)
        rate, count = await flood(client)
        row(name, f"{rate:.0f}", f"{count} of {FLOOD}", f"{(cpu(pid) - before) / FLOOD * 1e6:.0f}")
    client.close()


def main() -> int:
    parser = argparse.ArgumentParser(prog="bench bridge", description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="of bare and bridged calls in turn (%(default)s)")
    rounds = parser.parse_args().rounds
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        port = free_port()
        os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_LOG_DIR=folder)
        env = dict(os.environ)
        stack.enter_context(child(["rosmaster", "--core", "-p", str(port)], env))
        wait_for_port(port)
        ready_line(stack.enter_context(child([sys.executable, "-c", NODE, str(FLOOD)], env)))
        bridge = stack.enter_context(child([sys.executable, "-m", "rapp_bridge", "--port", "0"], env))
        bridge_port = json.loads(ready_line(bridge).removeprefix("READY "))["port"]
        rospy.init_node("bench", disable_signals=True, disable_rosout=True)
        asyncio.run(measure(bridge_port, bridge.pid, rounds))
        rospy.signal_shutdown("measured")
    return 0


if __name__ == "__main__":
    sys.exit(main())
