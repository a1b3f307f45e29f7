"""The person stops the robot, by a hand on its head or by the word, in each state of the core FSM in which it does something; and
a RApp that keeps failing is not started again and again. L11 and L13 of the list of faults.

That a walk ends in time, and that the word is heard as sound, is seen by `test_motion_faults`.
"""

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from fakes.rapps import write_four_agent_rapp, write_rapp
from fakes.whole_robot import Seen, WholeRobot, entered, listening_after, whole_robot

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

STOPPED = "You have stopped it"
HEAD = "Device/SubDeviceList/Head/Touch/Middle/Sensor/Value"
ENTRY = {
    "lazy": "communication.rapp_say('here')\nself.pause(60)",
    "listener": "communication.rapp_recognize(['yes', 'no'], 60.0)",
    "recorder": "communication.rapp_record(60.0)",
    "caller": "communication.rapp_say('here')\ncommunication.rapp_recognize(['go'], 60.0)\ncloud.call_wait('profile', timeout=60)",
    "fine": "communication.rapp_say('fine')",
    "breaks": "raise ValueError('on purpose')",
}
PERMISSIONS = {"core": ["rapp_say", "rapp_recognize", "rapp_record"], "cloud": ["profile"]}
SERVICE = "from rapp_hop.cloud_agent import service\n\n\n@service\ndef quick() -> str:\n    return 'quick'\n"
NEW = ("fresh", "unused")  # RApps that no case before has had downloaded
TWINS = {"castor": "please start one of the twins", "pollux": "start one of the twins please"}
FINE = "would you be so kind and run the program that is fine"


def rapps(folder: Path) -> list[Path]:
    made = [write_rapp(folder / name, name, body, permissions=PERMISSIONS) for name, body in ENTRY.items()]
    made += [write_rapp(folder / name, name, "pass") for name in NEW]
    slow = write_rapp(folder / "slow", "slow", "pass")
    (slow / "agent.py").write_text("import time\ntime.sleep(60)\n" + (slow / "agent.py").read_text())
    ends = write_rapp(folder / "ends", "ends", "pass")
    (ends / "agent.py").write_text((ends / "agent.py").read_text() + "\n    def dismantle(self) -> None:\n        self.pause(60)\n")
    made += [write_rapp(folder / name, name, "pass", sentences={"en": [sentence]}) for name, sentence in TWINS.items()]
    body = "cloud.call_agent_wait('quick')\ncommunication.rapp_say('here')\nself.pause(60)"
    return [*made, slow, ends, *write_four_agent_rapp(folder, "four", body, SERVICE, permissions=PERMISSIONS)]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WholeRobot]:
    folder = tmp_path_factory.mktemp("stop")
    robot = WholeRobot(folder / "robot", rapps(folder / "rapps"))
    robot.settings = "first_word = 60.0\nhang = 120.0\ndismantle = 60.0\nterminate = 0.5\nquarantine = 3600.0\n"
    robot.failures = 3
    with whole_robot(robot, "roscore", "cloud", "nao_sim", "rosbridge", "link", "core_agent"):
        lift_hand(robot)
        yield robot


def lay_hand(robot: WholeRobot) -> None:
    """On the middle of its head."""
    robot.naoqi.call("ALMemory", "insertData", HEAD, 1.0)


def lift_hand(robot: WholeRobot) -> None:
    robot.naoqi.call("ALMemory", "insertData", HEAD, 0.0)


def said(words: str) -> Callable[[Seen], bool]:
    return lambda seen: (seen.kind, seen.detail) == ("said", words)


def by_hand(robot: WholeRobot, since: int) -> Seen:
    lay_hand(robot)
    try:
        return robot.until(said(STOPPED), since)
    finally:
        lift_hand(robot)


def by_word(robot: WholeRobot, since: int) -> Seen:
    return robot.say_until("stop", said(STOPPED), since)


def command(robot: WholeRobot, text: str) -> None:
    """The person says a whole sentence, again when it was not heard."""
    since = len(robot.seen)
    for _ in range(4):
        robot.room("personSay", text, "en-us+m3", {"speed": 200.0})
        with suppress(AssertionError):
            robot.until(entered("s5"), since, 5.0)
            return
    raise AssertionError(f"{text!r} was not heard\n{robot.story(since)}")


Stop = Callable[[WholeRobot, int], Seen]


@contextmanager
def platform_stands_still(robot: WholeRobot) -> Iterator[None]:
    robot.freeze("cloud")
    try:
        yield
    finally:
        robot.thaw("cloud")


def stop_at(robot: WholeRobot, stop: Stop, since: int, reached: Callable[[Seen], bool]) -> list[Seen]:
    """Stop the robot once something has happened; gives what it told from there to s3, when nothing of the run is left.

    What comes later is not of this run: the person, who was not answered at once, may have said the keyword twice.
    """
    begun = robot.until(reached, since)
    listening = robot.until(listening_after(stop(robot, since)), since)
    robot.until_only_the_spare_runs()
    robot.until_only_the_cloud_spare_runs()
    return robot.seen[robot.seen.index(begun) : robot.seen.index(listening) + 1]


def states(run: list[Seen]) -> list[str]:
    return [seen.state for seen in run if (seen.agent, seen.machine, seen.kind) == ("core", "core", "entered")]


def words(run: list[Seen]) -> list[str]:
    return [seen.detail for seen in run if seen.kind == "said"]


both = pytest.mark.parametrize("stop", [by_hand, by_word])


def test_l11_s4_a_hand_that_lies_on_its_head_lets_nothing_begin(robot: WholeRobot) -> None:
    since = len(robot.seen)
    lay_hand(robot)
    robot.ask("fine")
    run = stop_at(robot, by_hand, since, entered("s4"))
    assert states(run)[-2:] == ["s11", "s3"]
    assert words(run) == [STOPPED]


@both
def test_l11_s5_what_the_platform_understands_is_not_waited_for(robot: WholeRobot, stop: Stop) -> None:
    since = len(robot.seen)
    with platform_stands_still(robot):
        command(robot, FINE)
        assert states(stop_at(robot, stop, since, entered("s5"))) == ["s5", "s11", "s3"]
    assert "core->link cancel interpret (asynchronous)" in robot.messages(since)


@pytest.mark.parametrize(("stop", "name"), list(zip((by_hand, by_word), NEW, strict=True)))
def test_l11_s6_a_download_is_given_up(robot: WholeRobot, stop: Stop, name: str) -> None:
    since = len(robot.seen)
    with platform_stands_still(robot):
        robot.ask(name)
        assert states(stop_at(robot, stop, since, entered("s6"))) == ["s6", "s11", "s3"]
    assert f"core->link cancel install {name} (asynchronous)" in robot.messages(since)
    assert not (robot.home / "rapps" / name / "current").exists()


@pytest.mark.parametrize(("state", "stop"), [("s7", by_hand), ("s8", by_hand), ("s8", by_word)])
def test_l11_s7_s8_a_rapp_that_starts_is_ended(robot: WholeRobot, stop: Stop, state: str) -> None:
    since = len(robot.seen)
    robot.ask("slow")
    run = stop_at(robot, stop, since, entered(state))
    assert states(run)[-4:] == ["s8", "s10", "s11", "s3"]
    assert words(run) == [STOPPED]


@pytest.mark.parametrize(
    ("stop", "name", "reached"),
    [
        (by_hand, "lazy", said("here")),
        (by_word, "lazy", said("here")),
        (by_word, "listener", lambda seen: seen.detail == "core->ALSpeechRecognition subscribe"),
        (by_word, "recorder", lambda seen: "startMicrophonesRecording" in seen.detail),
        (by_word, "four", said("here")),
    ],
    ids=["hand, idle", "word, idle", "word, listening", "word, recording", "word, four agents"],
)
def test_l11_s9_a_rapp_that_runs_is_ended_whatever_it_does(
    robot: WholeRobot, stop: Stop, name: str, reached: Callable[[Seen], bool]
) -> None:
    since = len(robot.seen)
    robot.ask(name)
    run = stop_at(robot, stop, since, reached)
    assert [state for state in states(run) if state != "s9"] == ["s10", "s11", "s3"]  # the RApp may speak before that is told
    assert [text for text in words(run) if text != "here"] == [STOPPED]


def test_l11_s9_a_rapp_that_waits_for_the_platform_is_ended(robot: WholeRobot) -> None:
    since = len(robot.seen)
    robot.ask("caller")
    robot.until(said("here"), since)
    with platform_stands_still(robot):
        begun = robot.say_until("go", lambda seen: seen.detail == "core->link call profile", since)
        robot.until(listening_after(by_word(robot, since)), since)
    assert not any(seen.detail == "link->core reply call profile" for seen in robot.seen[robot.seen.index(begun) :])
    robot.until_only_the_spare_runs()


@both
def test_l11_s10_a_rapp_that_takes_its_time_to_end_is_not_waited_for(robot: WholeRobot, stop: Stop) -> None:
    since = len(robot.seen)
    robot.ask("ends")
    assert states(stop_at(robot, stop, since, entered("s10"))) == ["s10", "s11", "s3"]


@both
def test_l11_s12_a_question_is_given_up(robot: WholeRobot, stop: Stop) -> None:
    since = len(robot.seen)
    command(robot, TWINS["castor"])
    assert states(stop_at(robot, stop, since, entered("s12"))) == ["s12", "s11", "s3"]


def run_once(robot: WholeRobot, name: str) -> str:
    """Ask for a RApp; gives what the robot says until it listens again."""
    since = len(robot.seen)
    robot.ask(name)
    listening = robot.until(listening_after(robot.until(entered("s6"), since)), since)
    (text,) = words(robot.seen[since : robot.seen.index(listening)])
    return text


def test_l13_a_rapp_that_keeps_failing_is_not_started_until_there_is_another_version(robot: WholeRobot) -> None:
    refusal = "breaks keeps failing, I will not start it before "
    assert [run_once(robot, "breaks") for _ in range(3)] == ["It has failed"] * 3
    assert run_once(robot, "breaks").startswith(refusal)
    robot.stop("core_agent")
    since = len(robot.seen)
    robot.start("core_agent")
    robot.until_listening(since)
    assert run_once(robot, "breaks").startswith(refusal)
    assert run_once(robot, "fine") == "fine"
    robot.stop("link")  # so that the older version of the store is not fetched again
    folder = robot.home / "rapps" / "breaks"
    shutil.copytree(folder / "1.0.0", folder / "1.0.1")
    manifest = folder / "1.0.1" / "package.json"
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "version": "1.0.1"}))
    (folder / "new").symlink_to("1.0.1")
    (folder / "new").rename(folder / "current")
    assert run_once(robot, "breaks") == "It has failed"
    robot.start("link")
