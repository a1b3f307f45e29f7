"""The bridge with roslibpy. Its reactor runs once in a process: one program tells the whole story, in a process of its own."""

import asyncio
import subprocess
import sys

from fakes.bridge_neighbours import Peer

PROGRAM = """
import sys, threading, roslibpy
host, port = sys.argv[1].removeprefix("ws://").split(":")
ros = roslibpy.Ros(host, int(port)); ros.run(timeout=10)

def answer(request, response):
    response["success"] = True
    response["message"] = request["text"].upper()
    return True

offered = roslibpy.Service(ros, "/from_roslibpy", "rapp_msgs/Say"); offered.advertise(answer)
latched, echoed = threading.Event(), threading.Event()
kept = roslibpy.Topic(ros, "/latched", "std_msgs/String")
kept.subscribe(lambda m: latched.set() if m["data"] == "kept" else None)
echo = roslibpy.Topic(ros, "/echoed", "std_msgs/String")
echo.subscribe(lambda m: echoed.set() if m["data"] == "hello" else None)
speaker = roslibpy.Topic(ros, "/to_echo", "std_msgs/String"); speaker.advertise()
say = roslibpy.Service(ros, "/say", "rapp_msgs/Say")
assert say.call(roslibpy.ServiceRequest({"text": "hi"}), timeout=10)["message"] == "hi"
failures = []
try: say.call(roslibpy.ServiceRequest({"text": "fail"}), timeout=10)
except Exception as error: failures.append(str(error))
assert "no voice" in failures[0], failures
assert latched.wait(10)
for _ in range(100):
    speaker.publish(roslibpy.Message({"data": "hello"}))
    if echoed.wait(0.1): break
assert echoed.is_set()
print("offering", flush=True); sys.stdin.readline()
kept.unsubscribe(); echo.unsubscribe(); speaker.unadvertise(); offered.unadvertise()
assert say.call(roslibpy.ServiceRequest({"text": "bye"}), timeout=10)["message"] == "bye"
ros.terminate()
"""


def test_roslibpy_calls_offers_publishes_and_subscribes(url: str, peer: Peer, ros_env: dict[str, str]) -> None:
    words = [sys.executable, "-c", PROGRAM, url]
    client = subprocess.Popen(words, env=ros_env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert client.stdout is not None
    try:
        assert client.stdout.readline().strip() == "offering"
        peer.call("/from_roslibpy", "loud")
        assert asyncio.run(peer.heard()) == "LOUD"
        client.communicate("end\n", timeout=20)
        assert client.returncode == 0
    finally:
        client.kill()
        client.communicate()
