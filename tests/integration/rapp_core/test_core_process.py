"""The whole core agent as a process: real ROS, real simulator, real sandboxes; the platform is away."""

import json
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from fakes.processes import children, ended
from fakes.rapps import install_rapp
from rapp_core.robot.naoqi.connection import Connection

SAYS_HELLO = 'communication.text_to_speech("hello from the RApp")'
PATIENCE = 20.0  # s
SIM = ("--microphone", "text", "--voice", "silent", "--no-world", "--port", "0")
REFUSED = "False cannot serve this call: only the dynamic agent that holds the core agent's lease is served"

WATCHER = """
import json, sys, rospy
from rapp_msgs.msg import AgentState
def tell(m):
    print(json.dumps([m.agent, m.machine, m.state, m.kind, m.detail]), flush=True)
rospy.init_node("watcher", anonymous=True, disable_rosout=True)
rospy.Subscriber("/core_agent/state", AgentState, tell, queue_size=1000)
print("READY", flush=True)
rospy.spin()
"""
ENTERED, FAILED, SAID, MESSAGE = 0, 2, 3, 5


class Watched:
    """A running core agent, what it publishes, and the person in its room."""

    def __init__(self, core: Any, world: Any, states: "queue.Queue[list[Any]]", home: Path) -> None:
        self.core, self.world, self.home = core, world, home
        self.seen: list[list[Any]] = []
        self._states = states

    def until(self, wanted: Callable[[list[Any]], bool]) -> list[list[Any]]:
        """Everything published up to and with what is wanted."""
        since, deadline = [], time.monotonic() + PATIENCE
        while not since or not wanted(since[-1]):
            assert time.monotonic() < deadline, f"it did not happen; seen were {since}"
            try:
                since.append(self._states.get(timeout=0.2))
            except queue.Empty:
                continue
        self.seen += since
        return since

    def until_state(self, state: str) -> list[list[Any]]:
        return self.until(lambda each: each[1:4] == ["core", state, ENTERED])


@pytest.fixture
def watched(start, ros_env, tmp_path: Path) -> Iterator[Callable[[], Watched]]:
    home = tmp_path / "home"
    home.mkdir()
    started: list[Any] = []

    def begin() -> Watched:
        states: queue.Queue[list[Any]] = queue.Queue()
        sim = start("rapp_nao_sim", *SIM, "--files", str(home))
        watcher = subprocess.Popen([sys.executable, "-c", WATCHER], env=ros_env, stdout=subprocess.PIPE, text=True)
        assert watcher.stdout is not None
        assert watcher.stdout.readline() == "READY\n"
        reader = threading.Thread(target=lambda: [states.put(json.loads(line)) for line in watcher.stdout or ()], daemon=True)
        reader.start()
        url = f"tcp://127.0.0.1:{sim.ready['port']}"
        core = start("rapp_core", "--robot", url, "--home", str(home))
        connection = Connection(url, 5.0)
        started.append((watcher, reader, connection))
        return Watched(core, connection.service("SimWorld"), states, home)

    yield begin
    for watcher, reader, connection in started:
        connection.close()
        watcher.terminate()
        watcher.wait(10)
        reader.join(5)
        watcher.stdout.close()


def said(seen: list[list[Any]]) -> list[str]:
    return [detail for _agent, _machine, _state, kind, detail in seen if kind == SAID]


def say(watched: Watched, keyword: str) -> None:
    """Say a keyword until it is heard: the recogniser is deaf between two listening rounds."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        watched.world.micText(keyword)
        try:
            state = watched._states.get(timeout=1.0)
        except queue.Empty:
            continue
        watched.seen.append(state)
        if state[2:4] == ["s4", ENTERED]:
            return
    raise AssertionError(f"{keyword} was not heard; seen were {watched.seen}")


def test_a_rapp_runs_without_platform_and_the_robot_listens_again(watched):
    core = watched()
    install_rapp(core.home, "greeter", SAYS_HELLO)
    core.until_state("s3")
    say(core, "greeter")
    seen = core.until_state("s3")
    assert said(seen) == ["hello from the RApp"]
    messages = [each[4] for each in seen if each[3] == MESSAGE]
    expected = [
        "core->dynamic activate (asynchronous)", "dynamic->core first_word (asynchronous)", "dynamic->core rapp_say",
        "core->ALTextToSpeech say", "ALTextToSpeech->core reply say", "core->dynamic reply rapp_say",
        "dynamic->core terminate (asynchronous)", "core->dynamic dismantle (asynchronous)", "dynamic->core gone (asynchronous)",
        "core: dynamic agent destroyed",
    ]  # fmt: skip
    assert [message for message in messages if message in expected] == expected
    assert core.core.stop() == 0
    assert list((core.home / "runs").iterdir()) == []


BREAKERS = {
    "crasher": ("import os\nos._exit(1)", "It has crashed"),
    "sleeper": ("import os, signal\nos.kill(os.getpid(), signal.SIGSTOP)", "It does not answer any more"),
    "thrower": ("raise ValueError('of no use')", "It has failed"),
    "eavesdropper": ("communication.capture_audio(5)  # not named in its package.json", "It has failed"),
}


def test_a_rapp_that_breaks_is_gone_and_the_robot_listens_again(watched):
    core = watched()
    for name, (body, _words) in BREAKERS.items():
        install_rapp(core.home, name, body)
    install_rapp(core.home, "greeter", SAYS_HELLO)
    core.until_state("s3")
    for name, (_body, words) in BREAKERS.items():
        say(core, name)
        assert said(core.until_state("s3")) == [words]
    say(core, "greeter")
    assert said(core.until_state("s3")) == ["hello from the RApp"]


def test_a_call_without_the_lease_is_refused(watched, ros_env):
    core = watched()
    core.until_state("s3")
    call = """
import rospy
from rapp_msgs.srv import Say
for headers in ({}, {"rapp_channel": "guess"}):
    rospy.wait_for_service("rapp_say", 5)
    answer = rospy.ServiceProxy("rapp_say", Say, persistent=True, headers=headers)("intruder", "en")
    print(answer.success, answer.message)
"""
    done = subprocess.run([sys.executable, "-c", call], env=ros_env, capture_output=True, text=True, timeout=30)
    assert (
        done.stdout.splitlines()
        == ["False cannot serve this call: only the dynamic agent that holds the core agent's lease is served"] * 2
    )


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_ends_with_all_its_children_in_the_midst_of_a_run(watched, number):
    core = watched()
    install_rapp(core.home, "endless", "import time\nwhile True: time.sleep(0.05)")
    core.until_state("s3")
    say(core, "endless")
    core.until_state("s9")
    running = children(core.core.process.pid)
    assert running
    assert core.core.stop(number) == 0
    assert all(ended(pid) for pid in running)


def test_without_a_master_it_waits_and_can_be_ended(ros_env, tmp_path):
    env = {**ros_env, "ROS_MASTER_URI": "http://127.0.0.1:1"}
    process = subprocess.Popen(
        [sys.executable, "-m", "rapp_core", "--home", str(tmp_path)], env=env, stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    with process.stderr:
        assert "cannot reach the ROS master" in process.stderr.readline()
        process.terminate()
        assert process.wait(10) == 0


def test_it_joins_a_master_that_comes_after_it(own_master, tmp_path):
    own_master.stop()
    words = [sys.executable, "-m", "rapp_core", "--robot", "tcp://127.0.0.1:1", "--home", str(tmp_path / "home")]
    with subprocess.Popen(words, env=own_master.env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert "cannot reach the ROS master" in process.stderr.readline()
            own_master.start()
            assert process.stdout.readline().startswith("READY ")
        finally:
            process.terminate()
        assert process.wait(PATIENCE) == 0


@pytest.mark.parametrize("frozen", [False, True])
def test_it_ends_whatever_the_ros_master_does(start, own_master, tmp_path, frozen):
    core = start("rapp_core", "--robot", "tcp://127.0.0.1:1", "--home", str(tmp_path / "home"), env=own_master.env)
    own_master.signal(signal.SIGSTOP if frozen else signal.SIGKILL)
    assert core.stop() == 0
