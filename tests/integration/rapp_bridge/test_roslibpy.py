"""The bridge with roslibpy, unchanged. Its reactor runs once in a process: each story is a program in a process of its own."""

import asyncio
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from fakes.bridge_neighbours import PATIENCE, Peer
from fakes.bridge_workshop import workshop

BEGIN = """
import base64, sys, threading, roslibpy
host, port = sys.argv[1].removeprefix("ws://").split(":")
ros = roslibpy.Ros(host, int(port)); ros.run(timeout=10)

def heard(name, kind, passes, **more):
    event, topic = threading.Event(), roslibpy.Topic(ros, name, kind, **more)
    topic.subscribe(lambda message: event.set() if passes(message) else None)
    return event, topic
"""

TOPICS_AND_SERVICES = """
def answer(request, response):
    if request["text"] == "false": return False
    response["success"] = True
    response["message"] = request["text"].upper()
    return True

offered = roslibpy.Service(ros, "/from_roslibpy", "rapp_msgs/Say"); offered.advertise(answer)
latched, kept = heard("/latched", "std_msgs/String", lambda m: m["data"] == "kept")
echoed, echo = heard("/echoed", "std_msgs/String", lambda m: m["data"] == "hello", throttle_rate=1, queue_length=5)
seen, image = heard("/workshop/image", "sensor_msgs/Image", lambda m: base64.b64decode(m["data"]) == bytes(range(96)))
scanned, scan = heard("/workshop/scan", "sensor_msgs/LaserScan", lambda m: m["ranges"] == [0.5, 1.5, None])
speaker = roslibpy.Topic(ros, "/to_echo", "std_msgs/String"); speaker.advertise()
say = roslibpy.Service(ros, "/say", "rapp_msgs/Say")
assert say.call(roslibpy.ServiceRequest({"text": "hi"}), timeout=10)["message"] == "hi"
failures = []
try: say.call(roslibpy.ServiceRequest({"text": "fail"}), timeout=10)
except Exception as error: failures.append(str(error))
assert "no voice" in failures[0], failures
assert latched.wait(10) and seen.wait(10) and scanned.wait(10)
for _ in range(100):
    speaker.publish(roslibpy.Message({"data": "hello"}))
    if echoed.wait(0.1): break
assert echoed.is_set()
print("offering", flush=True); sys.stdin.readline()
for topic in (kept, echo, image, scan): topic.unsubscribe()
speaker.unadvertise(); offered.unadvertise()
assert say.call(roslibpy.ServiceRequest({"text": "bye"}), timeout=10)["message"] == "bye"
ros.terminate()
"""

ROSAPI = """
assert ros.get_time()["secs"] > 0
assert "/workshop/image" in ros.get_topics()
assert ros.get_topic_type("/workshop/image") == "sensor_msgs/Image"
assert "/workshop/scan" in ros.get_topics_for_type("sensor_msgs/LaserScan")
assert "/say" in ros.get_services()
assert ros.get_service_type("/say") == "rapp_msgs/Say"
assert "/say" in ros.get_services_for_type("rapp_msgs/Say")
assert ros.get_service_request_details("rapp_msgs/Say")["typedefs"][0]["fieldnames"] == ["text", "language"]
assert ros.get_service_response_details("rapp_msgs/Say")["typedefs"][0]["fieldnames"][0] == "success"
assert ros.get_message_details("std_msgs/Header")["typedefs"][0]["fieldnames"] == ["seq", "stamp", "frame_id"]
assert "/workshop" in ros.get_nodes()
assert "/workshop/out" in ros.get_node_details("/workshop")["publishing"]
assert "/workshop/size" in ros.get_params()
assert ros.get_param("/workshop/size") == 96
ros.set_param("/from_roslibpy/param", {"a": [1, "b"]})
assert ros.get_param("/from_roslibpy/param") == {"a": [1, "b"]}
param = roslibpy.Param(ros, "/from_roslibpy/param"); param.delete()
assert param.get() is None
found, servers = threading.Event(), []
ros.get_action_servers(lambda answer: (servers.extend(answer["action_servers"]), found.set()))
assert found.wait(10) and "/workshop/count" in servers, servers
ros.terminate()
"""

ACTIONS = """
from roslibpy.ros1.actionlib import ActionClient, Goal, GoalStatus
client = ActionClient(ros, "/workshop/count", "actionlib/TestAction")

def begin(number):
    goal, feedback = Goal(client, roslibpy.Message({"goal": number})), []
    begun, preempted = threading.Event(), threading.Event()
    goal.on("status", lambda status: preempted.set() if status["status"] == GoalStatus.PREEMPTED else None)
    goal.on("feedback", lambda message: (feedback.append(message["feedback"]), begun.set()))
    goal.send()
    return goal, feedback, begun, preempted

goal, feedback, _, _ = begin(5)
assert goal.wait(20)["result"] == 5
assert goal.status["status"] == GoalStatus.SUCCEEDED and feedback == [1, 2, 3, 4, 5], feedback
goal, feedback, begun, preempted = begin(1_000_000)
assert begun.wait(20)
goal.cancel()
assert goal.wait(20)["result"] < 1_000_000
assert preempted.wait(20)  # the status may come after the result
client.dispose()
ros.terminate()
"""


@pytest.fixture(scope="module", autouse=True)
def _workshop(ros_env: dict[str, str]) -> Iterator[None]:
    with workshop(ros_env):
        yield


@contextmanager
def told(story: str, url: str, env: dict[str, str]) -> Iterator["subprocess.Popen[str]"]:
    """A running story; it has to end well by itself, without a word of complaint."""
    words, pipe = [sys.executable, "-c", BEGIN + story, url], subprocess.PIPE
    client = subprocess.Popen(words, env=env, stdin=pipe, stdout=pipe, stderr=pipe, text=True)
    try:
        yield client
        _, errors = client.communicate("on\n", timeout=3 * PATIENCE)
        assert (client.returncode, errors) == (0, ""), errors
    finally:
        client.kill()
        client.communicate()


def test_roslibpy_calls_offers_publishes_and_subscribes(url: str, peer: Peer, ros_env: dict[str, str]) -> None:
    with told(TOPICS_AND_SERVICES, url, ros_env) as client:
        assert client.stdout is not None
        assert client.stdout.readline().strip() == "offering"
        peer.call("/from_roslibpy", "loud")
        assert asyncio.run(peer.heard()) == "LOUD"
        peer.call("/from_roslibpy", "false")
        assert asyncio.run(peer.heard()).startswith("error: ")


@pytest.mark.parametrize("story", [ROSAPI, ACTIONS], ids=["rosapi", "actions"])
def test_roslibpy_with(url: str, peer: Peer, ros_env: dict[str, str], story: str) -> None:
    with told(story, url, ros_env):
        pass
