"""Every day: a robot and a cloud that stay up, are spoken to, lose any of their processes, come back, and go down."""

import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rapp_cli.home.place import Home
from rapp_cli.home.supervisor import Supervisor
from rapp_cli.paths import ROOT

pytestmark = [pytest.mark.system, pytest.mark.timeout(180)]
QUICK = ("--microphone", "text", "--voice", "silent", "--no-world")
AGENTS = ["roscore", "mail", "cloud", "nao_sim", "rosbridge", "recorder", "link", "core_agent"]
BACK = 30.0  # s for an agent to be started again and the robot to be of use


class Desk:
    """Somebody at a terminal, with one home."""

    def __init__(self, home: Path) -> None:
        self.home = home

    def rapp(self, *words: str, timeout: float = 120) -> subprocess.CompletedProcess[str]:
        command = [str(ROOT / "rapp"), *words, "--home", str(self.home)]
        return subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False)

    def done(self, *words: str) -> str:
        """Output of a command that must succeed."""
        result = self.rapp(*words)
        assert result.returncode == 0, f"{words}: {result.stdout}{result.stderr}{self.logs()}"
        return result.stdout

    def status(self) -> dict[str, Any]:
        value: dict[str, Any] = json.loads(self.rapp("status", "--json").stdout)
        return value

    def pid(self, agent: str) -> int | None:
        return Supervisor(Home(self.home)).processes()[agent].pid

    def logs(self) -> str:
        """The ends of all logs: who did what."""
        logs = sorted(self.home.glob("logs/*.log"))
        return "\n".join("\n".join([f"--- {log}", *log.read_text(errors="replace").splitlines()[-15:]]) for log in logs)

    def processes(self) -> list[str]:
        """Command lines of the processes that belong to the home, by their words or their environment."""
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                words = (folder / "cmdline").read_bytes()
                if bytes(self.home) in words + (folder / "environ").read_bytes() and int(folder.name) != os.getpid():
                    found.append(words.replace(b"\0", b" ").decode(errors="replace"))
            except OSError:
                continue  # it ended meanwhile
        return found

    def assert_nothing_is_left(self) -> None:
        deadline = time.monotonic() + 15
        while self.processes() and time.monotonic() < deadline:
            time.sleep(0.1)
        assert self.processes() == []


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    desk = Desk(tmp_path_factory.mktemp("every day") / "home")
    try:
        assert "robot      listens" in desk.done("up", *QUICK)
        yield desk
    finally:
        desk.rapp("down")


def test_status_shows_every_agent_and_where_the_core_agent_is(desk: Desk) -> None:
    status = desk.status()
    assert [(agent["name"], agent["state"]) for agent in status["agents"]] == [(name, "RUNNING") for name in AGENTS]
    assert (status["core"]["state"], status["rapp"], status["registered"], status["mails_waiting"]) == ("s3", None, True, 0)
    assert time.time() - 60 < status["core"]["since"] <= time.time()
    assert "registered" in desk.done("status")


def test_up_again_changes_nothing_and_other_wishes_are_refused(desk: Desk) -> None:
    before = desk.status()["agents"]
    assert "up already" in desk.done("up", *QUICK)
    refused = desk.rapp("up", "--robot", "tcp://nao.local:9559")
    assert (refused.returncode, "down first" in refused.stderr) == (2, True), refused.stderr
    assert desk.status()["agents"] == before


def test_a_voice_mail_is_said_from_the_terminal_in_two_goes(desk: Desk) -> None:
    assert "waits for an answer" in desk.done("say", "e-mail")
    status = desk.status()
    assert (status["core"]["state"], status["rapp"]) == ("s9", "voice_mail")
    shown = desk.done("say", "Elizabeth", "bring some water")
    assert "says  “I have finished, your message to Elizabeth is sent”" in shown
    assert len(list((desk.home / "mail" / "new").iterdir())) == 1


def test_the_timeline_is_recorded_with_its_times(desk: Desk) -> None:
    desk.done("say", "hello")
    entries = [json.loads(line) for line in (desk.home / "timeline.jsonl").read_text().splitlines()]
    person = [entry["detail"] for entry in entries if entry["agent"] == "person"]
    assert person == ["e-mail", "Elizabeth", "bring some water", "hello"]
    moments = [entry["time"] for entry in entries if entry["agent"] == "core"]
    assert moments == sorted(moments)
    assert time.time() > moments[-1] > moments[0] > time.time() - 180


def test_what_nobody_knows_is_not_understood(desk: Desk) -> None:
    result = desk.rapp("say", "banana")
    assert (result.returncode, "has not understood" in result.stderr) == (1, True), result.stdout


@pytest.mark.parametrize("agent", AGENTS)
def test_an_agent_that_is_killed_comes_back_and_the_robot_is_of_use_again(desk: Desk, agent: str) -> None:
    before = desk.pid(agent)
    assert before is not None
    os.kill(before, signal.SIGKILL)
    deadline = time.monotonic() + BACK
    while desk.pid(agent) in (before, None):
        assert time.monotonic() < deadline, desk.logs()
    while "happy to see you" not in (result := desk.rapp("say", "hello", "--timeout", "10")).stdout:
        assert time.monotonic() < deadline, f"{result.stdout}{result.stderr}{desk.logs()}"


def test_logs_are_shown_with_the_names_of_their_agents(desk: Desk) -> None:
    lines = desk.done("log", "--no-follow", "-n", "1000").splitlines()
    assert {line.split(" | ")[0].strip() for line in lines} >= {"cloud", "core_agent", "link", "nao_sim", "supervisor"}
    assert "rapp_link" in desk.done("log", "link", "--no-follow")
    unknown = desk.rapp("log", "nobody")
    assert (unknown.returncode, "core_agent" in unknown.stderr) == (2, True)


def test_down_leaves_nothing_and_may_be_said_twice(desk: Desk) -> None:
    ended = desk.done("down").splitlines()
    assert ended == [f"rapp down: {agent} ended" for agent in reversed(AGENTS)]
    desk.assert_nothing_is_left()
    assert desk.rapp("status").returncode == 3
    assert "nothing is up" in desk.done("down")
    assert desk.rapp("say", "hello").returncode == 1


def test_a_robot_that_cannot_be_reached_is_said_and_what_was_started_is_ended(desk: Desk) -> None:
    desk.done("down")
    result = desk.rapp("up", "--robot", "tcp://127.0.0.1:1", "--timeout", "12")
    assert result.returncode == 1
    assert "cannot reach NAOqi" in result.stderr  # the end of the core agent's log
    desk.assert_nothing_is_left()


def test_agents_do_not_outlive_their_supervisor(desk: Desk) -> None:
    desk.done("up", *QUICK)
    os.kill(int((desk.home / "supervisor" / "supervisord.pid").read_text()), signal.SIGKILL)
    desk.assert_nothing_is_left()
    assert desk.rapp("status").returncode == 3
