"""The half of the core agent that serves a robot's body, as a process, and the programs that call it."""

import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rapp_core.robot.naoqi.connection import Connection

TESTS = Path(__file__).parents[1]
TOKEN = "secret of this test"
PATIENCE = 30.0  # s
STILL = 0.01  # m within `LOOK`, of a robot that does not walk
LOOK = 0.4  # s
CLIENT = f"""
import json, os, sys, threading, time
import actionlib, rospy
from rapp_msgs.msg import MoveToAction, MoveToGoal, TakePostureGoal
from rapp_api import Pose, RappError, core_agent, navigation, vision
from rapp_api.ros_core_agent import RosCoreAgent
rospy.init_node("client", anonymous=True, disable_rosout=True, disable_signals=True)
core_agent.use(RosCoreAgent({TOKEN!r}))
def outcome(call, *args):
    try:
        return call(*args)
    except RappError as error:
        return [type(error).__name__, str(error)]
def tell(value):
    os.write(1, (json.dumps(value) + "\\n").encode())  # whole, whichever thread tells
"""

WALK = """
def walk():
    tell(outcome(navigation.move_to, 1.5, 0.0, 0.0))
thread = threading.Thread(target=walk)
thread.start()
"""


class Half:
    """A simulated robot, the half of the core agent that serves its body, and RApps' halves that call it."""

    def __init__(self, url: str, process: subprocess.Popen[str], env: dict[str, str]) -> None:
        self.connection = Connection(url, 5.0)
        self.world = self.connection.service("SimWorld")
        self.motion = self.connection.service("ALMotion")
        self.process = process
        self.env = env

    def client(self, body: str) -> "Client":
        """A program that calls the core agent, begun."""
        return Client([sys.executable, "-c", CLIENT + body], self.env)

    def still(self) -> bool:
        """Whether the robot stands still."""
        before = self.world.getRobotPose()
        time.sleep(LOOK)
        after = self.world.getRobotPose()
        return math.dist(before[:2], after[:2]) < STILL

    def until_walking(self) -> None:
        start = self.world.getRobotPose()
        self.until(lambda: math.dist(start[:2], self.world.getRobotPose()[:2]) > 0.03)

    def until(self, condition: Callable[[], Any]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, "it did not happen"
            time.sleep(0.05)

    def memory(self) -> int:
        """Bytes that the half of the core agent has in memory."""
        pages = Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]
        return int(pages) * os.sysconf("SC_PAGE_SIZE")

    def end_lease(self) -> bool:
        """Gives whether the robot was moved under it."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write("end\n")
        self.process.stdin.flush()
        return self.process.stdout.readline() == "True\n"


class Client:
    """A calling program; its lines of JSON."""

    def __init__(self, words: list[str], env: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            words, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def say(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()

    def rest(self) -> list[Any]:
        """All further lines; it has ended then."""
        out, errors = self._process.communicate(timeout=PATIENCE)
        assert self._process.returncode == 0, errors[-3000:]
        return [json.loads(line) for line in out.splitlines()]


@contextmanager
def running_half(start: Callable[..., Any], ros_env: dict[str, str], folder: Path) -> Iterator[Half]:
    """Robot and half; `start` starts a module of ours. The lease is held by TOKEN."""
    sim = start("rapp_nao_sim", "--microphone", "text", "--voice", "silent", "--port", "0", "--files", str(folder))
    url = f"tcp://127.0.0.1:{sim.ready['port']}"
    env = {**ros_env, "PYTHONPATH": os.pathsep.join([str(TESTS), ros_env.get("PYTHONPATH", "")])}
    words = [sys.executable, str(TESTS / "integration" / "rapp_core" / "body_half.py"), url, TOKEN, str(folder)]
    with (folder / "half.log").open("wb") as log:
        process = subprocess.Popen(words, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True)
    assert process.stdout is not None
    assert process.stdin is not None
    assert process.stdout.readline().startswith("READY"), (folder / "half.log").read_text()
    half = Half(url, process, ros_env)
    yield half
    process.stdin.close()
    process.wait(10)
    process.stdout.close()
    half.connection.close()
