"""A node outlives its ROS master: killed and started anew, or frozen."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

PATIENCE = 20.0  # s
NODE = str(Path(__file__).with_name("node.py"))
ASK = "import rospy; from rapp_msgs.srv import Say; print(rospy.ServiceProxy('answer', Say)('hello', 'en').message)"
SHOUT = """
import threading, rospy
from std_msgs.msg import String
rospy.init_node("shouter", anonymous=True, disable_rosout=True, disable_signals=True)
came = threading.Event()
rospy.Subscriber("echo", String, lambda message: came.set() if message.data == "HELLO" else None)
shout = rospy.Publisher("shout", String, queue_size=1)
for _ in range(100):
    shout.publish("hello")
    if came.wait(0.1):
        print("HELLO came back")
        break
"""


def run(script: str, env: dict[str, str]) -> str:
    done = subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, timeout=60, check=False)
    return done.stdout + done.stderr


def eventually_answers(env: dict[str, str]) -> str:
    deadline = time.monotonic() + PATIENCE
    while "hello" not in (answer := run(ASK, env)) and time.monotonic() < deadline:
        time.sleep(0.2)
    return answer


@pytest.fixture
def survivor(own_master: Any, tmp_path: Path) -> Iterator["subprocess.Popen[str]"]:
    with (tmp_path / "node.log").open("w") as log:
        words = [sys.executable, NODE, "300"]
        process = subprocess.Popen(words, env=own_master.env, stdout=subprocess.PIPE, stderr=log, text=True)
    assert process.stdout is not None
    try:
        assert process.stdout.readline().startswith("READY")
        yield process
    finally:
        process.kill()
        process.communicate()


def test_r01_its_service_and_topics_are_there_again_after_a_new_master_has_started(own_master, survivor):
    assert "hello" in run(ASK, own_master.env)
    own_master.signal(signal.SIGKILL)
    own_master.stop()
    own_master.start()
    assert "hello" in eventually_answers(own_master.env)
    assert "HELLO came back" in run(SHOUT, own_master.env)


def test_it_stands_a_master_that_freezes(own_master, survivor):
    own_master.signal(signal.SIGSTOP)
    time.sleep(3)  # longer than the patience of one question
    own_master.signal(signal.SIGCONT)
    assert "hello" in eventually_answers(own_master.env)
    assert "HELLO came back" in run(SHOUT, own_master.env)
