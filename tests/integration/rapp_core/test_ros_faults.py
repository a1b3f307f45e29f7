"""The core agent and its dynamic agents in a ROS that misbehaves: names taken twice, clocks that stand or jump, late listeners."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rosgraph

from fakes.rapps import install_rapp
from rapp_core.robot.naoqi.connection import Connection

PATIENCE = 30.0  # s
SIM = ("--microphone", "text", "--voice", "silent", "--no-world", "--port", "0")
NAMESAKE = """
import rospy
rospy.init_node("core_agent", disable_rosout=True, disable_signals=True)
print("READY", flush=True)
rospy.spin()
"""
LATE = """
import rospy
from rapp_msgs.msg import AgentState
rospy.init_node("late", disable_rosout=True)
message = rospy.wait_for_message("/core_agent/state", AgentState, 20)
print(message.agent, message.state, message.stamp.to_sec() > 0)
"""
CLOCK = """
import sys, rospy
from rosgraph_msgs.msg import Clock
rospy.init_node("clock", disable_rosout=True, disable_signals=True)
publisher = rospy.Publisher("/clock", Clock, queue_size=10, latch=True)
for line in sys.stdin:
    publisher.publish(Clock(rospy.Time.from_sec(float(line))))
    print("told", flush=True)
"""


class Home:
    """A robot without a body, its core agent with a ROS master of their own, and a person."""

    def __init__(self, start: Callable[..., Any], env: dict[str, str], folder: Path) -> None:
        self.env, folder = env, folder / "home"
        folder.mkdir()
        install_rapp(folder, "greeter", "communication.text_to_speech('hello from the RApp')")
        sim = start("rapp_nao_sim", *SIM, "--files", str(folder), env=env)
        url = f"tcp://127.0.0.1:{sim.ready['port']}"
        self.connection = Connection(url, 5.0)
        self._world = self.connection.service("SimWorld")
        self.said: list[str] = []
        self._world.robotSaid.connect(self.said.append)
        self.core = start("rapp_core", "--robot", url, "--home", str(folder), env=env)
        self.until(lambda: any("I am ready" in text for text in self.said))

    def until(self, condition: Callable[[], Any], meanwhile: Callable[[], Any] = lambda: None) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, f"it did not happen; said was {self.said}"
            meanwhile()
            time.sleep(0.3)

    def greeted(self) -> None:
        """Ask the RApp to run until it has spoken once more."""
        before = self.said.count("hello from the RApp")
        self.until(lambda: self.said.count("hello from the RApp") > before, lambda: self._world.micText("greeter"))


@pytest.fixture
def home(start: Any, own_master: Any, tmp_path: Path) -> Iterator[Callable[[], Home]]:
    homes: list[Home] = []

    def begin() -> Home:
        homes.append(Home(start, own_master.env, tmp_path))
        return homes[-1]

    yield begin
    for each in homes:
        each.connection.close()


def test_r02_another_node_under_its_name_ends_it_and_the_next_one_serves(home: Callable[[], Home], start: Any) -> None:
    robot = home()
    with subprocess.Popen([sys.executable, "-c", NAMESAKE], env=robot.env, stdout=subprocess.PIPE, text=True) as namesake:
        try:
            assert namesake.stdout is not None
            assert namesake.stdout.readline() == "READY\n"
            assert robot.core.process.wait(PATIENCE) == 0
        finally:
            namesake.kill()
    robot.said.clear()
    words = robot.core.process.args
    start("rapp_core", *words[words.index("--robot") :], env=robot.env)
    robot.greeted()


def test_r09_a_virtual_clock_that_stands_still_or_jumps_changes_nothing(home: Callable[[], Home], own_master: Any) -> None:
    rosgraph.Master("/test", own_master.uri).setParam("/use_sim_time", True)
    robot = home()
    robot.greeted()
    words = [sys.executable, "-c", CLOCK]
    with subprocess.Popen(words, env=robot.env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as clock:
        assert clock.stdin is not None
        assert clock.stdout is not None
        for moment in ("1000", "5", "4000000000"):
            clock.stdin.write(f"{moment}\n")
            clock.stdin.flush()
            assert clock.stdout.readline() == "told\n"
            robot.greeted()
        clock.stdin.close()


def test_r12_who_comes_late_is_told_the_last_state(home: Callable[[], Home]) -> None:
    robot = home()
    robot.greeted()
    done = subprocess.run([sys.executable, "-c", LATE], env=robot.env, capture_output=True, text=True, timeout=PATIENCE)
    agent, state, stamped = done.stdout.split()
    assert (agent, stamped) == ("core", "True"), done.stderr
    assert state.startswith("s")
