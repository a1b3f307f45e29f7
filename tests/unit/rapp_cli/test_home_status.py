"""What `status` puts together."""

import argparse
import json
from dataclasses import asdict
from typing import Any

import pytest

from fakes.rapps import install_rapp
from rapp_cli.errors import CommandError
from rapp_cli.home import platform, retry, status
from rapp_cli.home.place import Home, Settings
from rapp_cli.home.status import State, Status, Told
from rapp_cli.home.supervisor import Process
from rapp_cli.timeline import Entry, append
from rapp_core.config import Config
from rapp_core.control.quarantine import Quarantine
from rapp_link.letter import Letter, Outcome, to_json

NOW = 1_800_000_000.0


def process(name: str, **other: Any) -> Process:
    fields = {"name": name, "state": "RUNNING", "since": NOW - 60, "pid": None, "problem": ""}
    return Process(**{**fields, **other})


@pytest.fixture
def home(tmp_path_factory: pytest.TempPathFactory) -> Home:
    home = Home(tmp_path_factory.mktemp("home"))  # a short path: a socket belongs to it
    home.make()
    return home


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch) -> None:
    async def nobody(_bridge: str, _patience: float) -> None:
        return None

    monkeypatch.setattr(platform, "registered", nobody)


BOTH = {name: process(name) for name in ("recorder", "core_agent")}


def core(entries: list[Entry], processes: dict[str, Process] | None = None) -> State | None:
    return status._told(reversed(entries), BOTH if processes is None else processes).core


def test_the_core_agent_is_in_the_state_it_entered_last() -> None:
    entries = [
        Entry("core", "core", "s3", "entered", "listen", NOW - 9),
        Entry("core", "core", "s9", "entered", "await and execute commands", NOW - 8),
        Entry("core", "rapp_say", "s9/say", "entered", "delegate to e_ls", NOW - 7),
        Entry("dynamic", "dynamic", "s31", "entered", "say", NOW - 6),
        Entry("core", "core", "s9", "said", "hello", NOW - 5),
    ]
    assert core(entries) == State("s9", "await and execute commands", NOW - 8)


def test_the_state_of_an_earlier_core_agent_is_not_that_of_the_present_one() -> None:
    assert core([Entry("core", "core", "s3", "entered", "listen", NOW - 61)]) is None


RUN = [
    Entry("dynamic", "dynamic", "s3", "entered", "execute", NOW - 50),
    Entry("core", "core", "s7", "entered", "activate", NOW - 10),
    Entry("core", "core", "s8", "entered", "await first word", NOW - 9),
    Entry("link", "link", "s8", "message", "link->core reply start_cloud_agent hazard", NOW - 8),
    Entry("core", "core", "s9", "entered", "await and execute commands", NOW - 7),
    Entry("dynamic", "dynamic", "s3", "entered", "execute", NOW - 6),
    Entry("dynamic", "voice_mail", "s34", "entered", "record message content", NOW - 5),
]


@pytest.mark.usefixtures("silent")
def test_a_rapp_that_tells_much_hides_neither_the_core_agents_state_nor_its_own(home: Home) -> None:
    home.keep(Settings("nao", None, None, None, (), {"rosbridge": 1}))
    for folder, name in ((home.robot, "hazard"), (home.cloud / "agents", "hazard_cloud")):
        (folder / "runs" / "1" / "package").mkdir(parents=True)
        (folder / "runs" / "1" / "package" / "package.json").write_text(json.dumps({"name": name}))
    for entry in RUN:
        append(home.timeline, entry)
    call = json.dumps(asdict(Entry("core", "core", "s9", "message", "dynamic->core rapp_get_robot_pose", NOW))) + "\n"
    with home.timeline.open("a") as lines:
        lines.write(call * 10_000)
    shown = status.text(home, status.read(home, BOTH), NOW)
    assert "core agent  s9 await and execute commands, since" in shown
    assert "RApp        hazard, s34 record message content, since" in shown
    assert "(5 s)" in shown
    assert "cloud agent hazard_cloud, since" in shown
    assert "(8 s)" in shown


def test_what_a_run_before_has_told_is_not_of_this_one() -> None:
    told = status._told(reversed(RUN[:3]), BOTH)
    assert told == Told(State("s8", "await first word", NOW - 9))
    told = status._told(reversed([*RUN, Entry("core", "core", "s3", "entered", "listen", NOW)]), BOTH)
    assert told == Told(State("s3", "listen", NOW))


@pytest.mark.parametrize("away", ["recorder", "core_agent"])
def test_without_recorder_or_core_agent_the_state_is_not_known(away: str) -> None:
    entries = [Entry("core", "core", "s3", "entered", "listen", NOW - 9)]
    assert core(entries) is not None
    assert core(entries, {**BOTH, away: process(away, state="BACKOFF")}) is None
    assert core(entries, {}) is None


def test_waiting_mails_are_counted_and_finished_ones_are_not(home: Home) -> None:
    outbox = home.robot / "link" / "outbox"
    for name, pending in (("a", ("x@y",)), ("b", ()), ("c", ("x@y",))):
        (outbox / name).mkdir(parents=True)
        (outbox / name / "letter.json").write_bytes(to_json(Letter(f"<{name}>", "me@y", ("x@y",), "", NOW, pending)))
    (outbox / "broken").mkdir()
    (outbox / "broken" / "letter.json").write_text("{")
    assert status.read(home, {}).mails_waiting == 2


def test_a_mail_refused_after_it_was_kept_is_shown_while_it_is_there(home: Home) -> None:
    letter = Letter("<a>", "me@y", ("x@y", "z@y"), "", NOW, ("x@y", "z@y")).after(Outcome(("z@y",), {"x@y": "550 no such mailbox"}))
    folder = home.robot / "link" / "outbox" / "a"
    folder.mkdir(parents=True)
    (folder / "letter.json").write_bytes(to_json(letter))
    assert status.read(home, {}).mails_undelivered == {}
    (folder / "message.eml").write_text("Subject: hello")
    shown = status.text(home, status.read(home, {}), NOW)
    assert "0 waiting" in shown
    assert f"not sent    to x@y: 550 no such mailbox; the mail is {folder / 'message.eml'}" in shown
    assert "z@y" not in shown


@pytest.mark.usefixtures("silent")
def test_the_running_rapp_is_the_one_whose_package_is_in_a_run(home: Home) -> None:
    home.keep(Settings("nao", None, None, None, (), {"rosbridge": 1}))
    for run in ("spare", "busy"):
        (home.robot / "runs" / run / "package").mkdir(parents=True)
    (home.robot / "runs" / "busy" / "package" / "package.json").write_text(json.dumps({"name": "voice_mail"}))
    append(home.timeline, Entry("core", "core", "s9", "entered", "await and execute commands", NOW))
    assert (status.read(home, BOTH).rapp, status.read(home, BOTH).cloud_agent) == ("voice_mail", None)
    agent = home.cloud / "agents" / "runs" / "busy" / "package"
    agent.mkdir(parents=True)
    (agent / "package.json").write_text(json.dumps({"name": "voice_mail_cloud"}))
    assert status.read(home, BOTH).cloud_agent == "voice_mail_cloud"
    append(home.timeline, Entry("core", "core", "s3", "entered", "listen", NOW))
    assert status.read(home, BOTH).rapp is None


def test_what_is_installed_on_the_robot(home: Home) -> None:
    install_rapp(home.robot, "clock")
    assert status.read(home, {}).installed == {"clock": "1.0.0"}


def test_people_are_told_what_runs_since_when_and_why_not(home: Home) -> None:
    agents = [process("roscore", pid=7), process("link", state="BACKOFF", since=NOW - 7200, problem="it ended with status 1")]
    lines = status.text(home, Status(agents, State("s3", "listen", NOW - 5), None, None, 3), NOW).splitlines()
    assert "running" in lines[0]
    assert "(1 min)" in lines[0]
    assert "process 7" in lines[0]
    assert "backoff" in lines[1]
    assert "(2 h)" in lines[1]
    assert "it ended with status 1" in lines[1]
    rest = "\n".join(lines[2:])
    for words in ("s3 listen", "(5 s)", "none runs", "the link does not answer", "3 waiting"):
        assert words in rest
    four = status.text(home, Status(agents, None, "hazard", True, 0, {"hazard": "1.2.0"}, "hazard_cloud"), NOW)
    assert "RApp        hazard\ncloud agent hazard_cloud" in four
    assert "installed   hazard 1.2.0\n" in four
    assert "./rapp up" in status.text(home, Status([], None, None, None, 0), NOW)


@pytest.mark.usefixtures("silent")
def test_a_rapp_in_quarantine_is_shown_until_it_is_to_be_tried_again(home: Home, capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(3):
        Quarantine(Config(home=home.robot)).failed("clock", "1.0.0", "ValueError: on purpose")
    shown = status.text(home, status.read(home, {}), NOW)
    assert "quarantine  clock 1.0.0 until " in shown
    assert "has failed 3 times in a row (ValueError: on purpose)" in shown
    words = argparse.Namespace(rapp="clock", home=home.folder)
    assert retry.run(words) == 0
    assert status.read(home, {}).quarantine == {}
    with pytest.raises(CommandError, match="has not failed"):
        retry.run(words)
