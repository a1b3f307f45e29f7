"""Voice-mail in the paper's words: a person speaks, a mail arrives. Two demos run at once, on real sound and real processes."""

import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from fakes.drawings import assert_kept
from fakes.processes import descendants, ended, environment, words
from rapp_cli.paths import ROOT
from rapp_cli.trace.command import read
from rapp_cli.trace.figures import FIGURES, figure
from rapp_cli.trace.mermaid import to_mermaid
from rapp_cli.trace.messages import last_run

pytestmark = [pytest.mark.system, pytest.mark.timeout(400)]
TIMEOUT = 240  # s of one demo
MARK = "RAPP_TEST_RUN"  # in the environment of all processes of a run
SAID_FIRST = "starting word recognition"
SUNDAY = "I will come home on Sunday afternoon"


@dataclass(frozen=True)
class Demo:
    """A finished run."""

    status: int
    output: str
    folder: Path

    @property
    def entries(self) -> list[dict[str, str]]:
        """What the agents published, in order."""
        return [json.loads(line) for line in (self.folder / "timeline.jsonl").read_text().splitlines()]

    def details(self, kind: str, agent: str = "core") -> list[str]:
        """Details of one kind of entry."""
        return [e["detail"] for e in self.entries if e["kind"] == kind and e["agent"] == agent]

    def states(self, agent: str) -> list[str]:
        """States an agent's FSMs entered, sub-FSMs of core services left out."""
        return [e["state"] for e in self.entries if e["kind"] == "entered" and e["agent"] == agent and "/" not in e["state"]]

    def logs(self) -> str:
        """The ends of all processes' logs: who did what."""
        logs = sorted(self.folder.glob("**/*.log"))
        tails = ["\n".join([f"--- {log}", *log.read_text(errors="replace").splitlines()[-25:]]) for log in logs]
        return "\n".join([self.output, *tails])


def demo_words(folder: Path, *options: str) -> list[str]:
    return [str(ROOT / "rapp"), "demo", "--folder", str(folder), *options]


def marked(folder: Path) -> dict[str, str]:
    """An environment by which `processes_of` knows the processes that a demo in this folder has started."""
    return {**os.environ, MARK: str(folder)}


def run_demo(folder: Path, *options: str) -> Demo:
    output: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    done = subprocess.run(demo_words(folder, *options), env=marked(folder), timeout=TIMEOUT, check=False, **output)
    return Demo(done.returncode, done.stdout, folder)


def processes_of(folder: Path) -> list[str]:
    """Command lines of the running processes that were started in a demo's environment."""
    mark = f"{MARK}={folder}".encode()
    pids = [int(path.name) for path in Path("/proc").glob("[0-9]*")]
    return [" ".join(words(pid)) for pid in pids if mark in environment(pid).split(b"\0")]


@pytest.fixture(scope="module")
def demos(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Demo]]:
    wishes = {
        "keyword": (),
        "long": (
            "--long",
            "--recipient",
            "Kowalska",
            "--voice",
            "en-us+f2",
            "--message",
            SUNDAY,
        ),
    }
    with ThreadPoolExecutor() as pool:
        runs = {name: pool.submit(run_demo, tmp_path_factory.mktemp(name), *options) for name, options in wishes.items()}
        yield {name: run.result() for name, run in runs.items()}


def assert_in_order(wanted: Sequence[str], happened: Sequence[str], demo: Demo) -> None:
    rest = iter(happened)
    for item in wanted:
        assert any(item == other for other in rest), f"{item!r} is missing, or not in its place, in {happened}\n{demo.logs()}"


@pytest.mark.parametrize("name", ["keyword", "long"])
def test_the_mail_arrives_with_the_spoken_message_and_nothing_is_left_running(demos: dict[str, Demo], name: str) -> None:
    demo = demos[name]
    assert demo.status == 0, demo.logs()
    assert len(list((demo.folder / "mail" / "new").iterdir())) == 1
    assert processes_of(demo.folder) == []


def test_a_keyword_is_understood_by_the_core_agent_itself(demos: dict[str, Demo]) -> None:
    demo = demos["keyword"]
    walked = demo.states("core")  # the demo watches from some time in s1 to s3 on
    assert walked[walked.index("s3") :] == ["s3", "s4", "s6", "s7", "s8", "s9", "s10", "s3"], demo.logs()
    assert demo.details("heard") == ["e-mail", "Elizabeth"]


def test_a_long_command_is_recorded_by_the_core_agent_and_interpreted_by_the_platform(demos: dict[str, Demo]) -> None:
    demo = demos["long"]
    assert_in_order(["s3", "s5", "s6", "s7", "s8", "s9", "s10", "s3"], demo.states("core"), demo)
    messages = ["core->link interpret", "link->core reply interpret: voice_mail", "core->link install voice_mail"]
    assert_in_order(messages, demo.details("message"), demo)
    assert "Kowalska" in demo.details("heard")


def test_the_dynamic_agent_walks_figures_3_and_8(demos: dict[str, Demo]) -> None:
    demo = demos["keyword"]
    walked = demo.states("dynamic")
    assert walked == ["s1", "s2", "s3", "s31", "s32", "s33", "s34", "s35", "s36", "end", "s4", "s5"], demo.logs()
    said = [SAID_FIRST, "recording message", "sending e-mail"]
    assert_in_order(said, demo.details("said"), demo)


@pytest.mark.parametrize("number", FIGURES)
@pytest.mark.parametrize("name", ["keyword", "long"])
def test_messages_come_in_the_order_of_the_papers_figures(demos: dict[str, Demo], name: str, number: int) -> None:
    drawn = [replace(item, times=1) for item in figure(last_run(read(demos[name].folder)), number)]
    assert_kept(f"figure-{number}", to_mermaid(drawn), "tests/system/test_voice_mail.py")


@pytest.mark.parametrize(
    "messages",
    [
        pytest.param(
            ["core->link install voice_mail", "link->repository GET timestamp.json", "repository->link reply GET timestamp.json",
             "link->core downloading (asynchronous)", "link->repository GET voice_mail-1.0.0.hz",
             "repository->link reply GET voice_mail-1.0.0.hz", "link->core verified (asynchronous)",
             "link->core installed (asynchronous)", "link->core reply install voice_mail",
             "core->dynamic activate (asynchronous)", "dynamic->core first_word (asynchronous)"],
            id="downloading and activating",
        ),
        pytest.param(
            ["dynamic->core rapp_cloud_call", "core->link call profile", "link->repository profile",
             "repository->link reply profile", "link->core reply call profile", "core->dynamic reply rapp_cloud_call"],
            id="asking the repository agent",
        ),
        pytest.param(
            ["dynamic->core terminate (asynchronous)", "core->dynamic dismantle (asynchronous)",
             "dynamic->core gone (asynchronous)", "core: dynamic agent destroyed"],
            id="dismantling",
        ),
    ],
)  # fmt: skip
def test_messages_beside_the_figures_come_in_order(demos: dict[str, Demo], messages: list[str]) -> None:
    demo = demos["keyword"]
    assert_in_order(messages, [e["detail"] for e in demo.entries if e["kind"] == "message"], demo)


def test_each_message_is_told_by_an_agent_that_sent_or_received_it(demos: dict[str, Demo]) -> None:
    messages = [(e["agent"], e["detail"].split(" ")[0]) for e in demos["long"].entries if e["kind"] == "message"]
    assert [(agent, ends) for agent, ends in messages if agent not in ends.rstrip(":").split("->")] == []
    assert {agent for agent, _ in messages} == {"core", "link"}


def test_a_run_is_drawn_with_all_who_took_part(demos: dict[str, Demo]) -> None:
    folder = demos["long"].folder
    words = [str(ROOT / "rapp"), "trace", str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.splitlines() == [str(folder / "trace.svg"), str(folder / "trace.mmd")]
    texts = [element.text for element in ElementTree.parse(folder / "trace.svg").iter() if element.tag.endswith("}text")]
    wanted = ["person", "core agent", "ALTextToSpeech", "dynamic agent", "link", "repository agent", "cloud agent (mail server)"]
    assert list(dict.fromkeys(name for name in texts if name in wanted)) == wanted
    mermaid = (folder / "trace.mmd").read_text()
    assert f"a_core-)person: “{SAID_FIRST}”" in mermaid
    assert f"person-)a_core: “{SUNDAY}”" in mermaid


def _heed_signals() -> None:
    """A shell starts its background jobs with SIGINT ignored, nohup with SIGHUP, and that is inherited."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


@dataclass(frozen=True)
class Interrupted:
    """A demo that was told to end while it ran."""

    status: int
    output: str
    running: list[str]  # command lines of its processes before
    left: list[str]  # and those that are still there


def interrupt(folder: Path, line: str, *numbers: signal.Signals) -> Interrupted:
    """Start a demo, and send it these signals once its output holds a text."""
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    process = subprocess.Popen(demo_words(folder), env=marked(folder), preexec_fn=_heed_signals, **pipes)
    assert process.stdout is not None
    try:
        seen = ""
        for told in process.stdout:
            seen += told
            if line in told:
                break
        pids, running = descendants(process.pid), processes_of(folder)
        for number in numbers:
            process.send_signal(number)
            time.sleep(0.4)
        output, _ = process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    deadline = time.monotonic() + 20
    while (left := processes_of(folder) + [" ".join(words(pid)) for pid in pids if not ended(pid)]) and time.monotonic() < deadline:
        time.sleep(0.1)
    return Interrupted(process.returncode, seen + output, running, left)


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Interrupted]:
    """One demo is interrupted while a dynamic agent runs, the others as soon as the robot's processes do."""
    wishes: dict[str, tuple[Any, ...]] = {
        "interrupt": (" s9 ", signal.SIGINT),
        "interrupt twice": (" core ", signal.SIGINT, signal.SIGINT),
        "terminate": (" core ", signal.SIGTERM),
        "hang up": (" core ", signal.SIGHUP),
    }
    with ThreadPoolExecutor(2) as pool:
        runs = {name: pool.submit(interrupt, tmp_path_factory.mktemp("x"), *wish) for name, wish in wishes.items()}
        return {name: run.result() for name, run in runs.items()}


@pytest.mark.parametrize("name", ["interrupt", "interrupt twice", "terminate", "hang up"])
def test_an_interrupted_demo_leaves_no_process(interrupted: dict[str, Interrupted], name: str) -> None:
    run = interrupted[name]
    for module in ("rosmaster", "rapp_cloud.mail", "rapp_hop.worker", "rapp_nao_sim", "rapp_bridge", "rapp_link", "rapp_core"):
        assert any(module in command for command in run.running), run
    assert (run.status, run.left) == (130, []), run.output
