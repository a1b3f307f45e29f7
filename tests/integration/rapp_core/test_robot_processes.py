"""`robot`: every process of a robot is started, found, and ended."""

import json
import os
import select
import signal
import subprocess
from pathlib import Path

import pytest

from fakes.processes import children, ended, environment, words

SCRIPT = Path(__file__).parents[3] / "catkin_ws" / "src" / "rapp_core" / "scripts" / "robot"
WORDS = ("--microphone", "text", "--voice", "silent", "--no-world")
READY = 60.0  # s


@pytest.fixture
def robot(tmp_path):
    process = subprocess.Popen(
        [SCRIPT, "--home", str(tmp_path / "home"), *WORDS],
        env={**os.environ, "RAPP_CLOUD": "http://127.0.0.1:1", "RAPP_SMTP_PASSWORD": "of the mail"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    yield process
    if process.poll() is None:
        process.terminate()
    process.communicate(timeout=30)


def ready(robot):
    assert select.select([robot.stdout], [], [], READY)[0], "it did not become ready"
    line = robot.stdout.readline()
    assert line.startswith("READY "), line
    return json.loads(line[6:])


def test_starts_all_and_leaves_none(robot, tmp_path):
    reached = ready(robot)
    assert reached["bridge"].startswith("ws://127.0.0.1:")
    assert reached["robot"].startswith("tcp://127.0.0.1:")
    assert reached["master"].startswith("http://127.0.0.1:")
    pids = children(robot.pid)
    grandchildren = [pid for child in pids for pid in children(child)]
    assert len(pids) == 5
    assert grandchildren  # the spare's sandbox, at least
    assert [words(pid)[2] for pid in (*pids, *grandchildren) if b"of the mail" in environment(pid)] == ["rapp_link"]
    robot.send_signal(signal.SIGTERM)
    assert robot.wait(30) == 0
    assert [pid for pid in (*pids, *grandchildren) if not ended(pid)] == []
    logs = {path.name for path in (tmp_path / "home" / "logs").glob("*.log")}
    assert logs >= {"roscore.log", "nao_sim.log", "rosbridge.log", "link.log", "core_agent.log"}


def test_when_one_process_ends_all_end_and_its_log_is_shown(robot):
    ready(robot)
    pids = children(robot.pid)
    os.kill(pids[-1], signal.SIGKILL)
    assert robot.wait(30) == 1
    assert "so the robot ends" in robot.stderr.read()
    assert [pid for pid in pids if not ended(pid)] == []
