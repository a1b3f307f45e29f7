"""What the robot does not understand: it says so or asks, starts nothing wrong, and listens again."""

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from fakes.rapps import write_rapp
from fakes.robot_behind_faults import RobotBehindFaults
from fakes.whole_robot import entered, processes_of
from rapp_cli.paths import STORE

pytestmark = [pytest.mark.system, pytest.mark.timeout(180)]

NOT_UNDERSTOOD = "I did not understand you"
PROFILE = {"name": "Maria", "language": "en", "contacts": [{"name": "Elizabeth", "address": "elizabeth@home.example"}]}
SETTINGS = """
recognise_timeout = 1.2
listening_round = 1.0
catalogue_again = 1.0
"""
PERSON = "en-us+m3"
PLAY = {"chess": "play a game with me", "draughts": "please play a game with me"}
QUIET, LOUD = 60.0, 1500.0  # RMS of the room's noise; speech has about 2000


def rapps(folder: Path) -> list[Path]:
    games = [
        write_rapp(folder / name, name, f"communication.rapp_say('{name}')", sentences={"en": [play, f"I want to play {name}"]})
        for name, play in PLAY.items()
    ]
    return [*games, write_rapp(folder / "fine", "fine", "communication.rapp_say('fine')"), STORE / "voice_mail"]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RobotBehindFaults]:
    folder = tmp_path_factory.mktemp("misheard")
    robot = RobotBehindFaults(folder, rapps(folder / "rapps"), PROFILE)
    robot.settings = SETTINGS
    try:
        robot.start()
        robot.served("fine", "fine")
        yield robot
    finally:
        robot.close()
    assert processes_of(folder) == []


def states(robot: RobotBehindFaults, since: int) -> list[str]:
    return [seen.state for seen in robot.seen[since:] if seen.kind == "entered" and seen.machine == "core"]


@pytest.mark.parametrize("word", ["xylophone", ""], ids=["a word outside the vocabulary", "silence"])
def test_nothing_happens(robot: RobotBehindFaults, word: str) -> None:
    robot.served("fine", "fine")
    since, until = len(robot.seen), time.monotonic() + 2.5  # two listening rounds and more
    while time.monotonic() < until:
        if word:
            robot.say(word)
        time.sleep(0.25)
    assert [seen for seen in robot.seen[since:] if seen.kind in ("entered", "said", "heard")] == []
    robot.served("fine", "fine")


def test_v05_a_long_command_that_fits_nothing(robot: RobotBehindFaults) -> None:
    since = robot.command("the old castle stands on a hill above the town")
    assert robot.refused(since) == NOT_UNDERSTOOD
    assert states(robot, since) == ["s5", "s11", "s3"]


def asked_which(robot: RobotBehindFaults) -> int:
    since = robot.command("would you please play a game with me")
    question = robot.until(lambda seen: (seen.state, seen.kind) == ("s12", "said"), since).detail
    assert question in ("Do you mean chess or draughts?", "Do you mean draughts or chess?")
    return since


def test_v03_a_long_command_that_fits_two_is_asked_about_and_the_answer_runs(robot: RobotBehindFaults) -> None:
    since = asked_which(robot)
    robot.say_until("draughts", entered("s6"), since)
    said = robot.until(lambda seen: (seen.kind, seen.detail) == ("said", "draughts"), since)
    robot.until_listening(robot.seen.index(said))
    assert states(robot, since) == ["s5", "s12", "s6", "s7", "s8", "s9", "s10", "s3"]


@pytest.mark.parametrize(("answer", "words"), [("", NOT_UNDERSTOOD), ("no", "All right, I do nothing")])
def test_a_question_without_a_useful_answer_is_given_up(robot: RobotBehindFaults, answer: str, words: str) -> None:
    since = asked_which(robot)
    if answer:
        robot.say_until(answer, entered("s11"), since)
    assert robot.refused(since) == words
    assert states(robot, since) == ["s5", "s12", "s11", "s3"]


def test_a_recipient_not_understood_three_times(robot: RobotBehindFaults) -> None:
    since = len(robot.seen)
    robot.ask("e-mail")
    robot.until_listening(robot.seen.index(robot.until(entered("s10"), since)))
    said = [seen.detail for seen in robot.seen[since:] if (seen.kind, seen.state) == ("said", "s9")]
    again = "I did not understand the name, please say it again"
    assert said == ["starting word recognition", again, again, "I am sorry, I do not know to whom I should write"]
    assert list((robot.maildir / "new").iterdir()) == []


@pytest.fixture(scope="module")
def hearing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RobotBehindFaults]:
    """A robot that hears sound."""
    folder = tmp_path_factory.mktemp("hearing")
    robot = RobotBehindFaults(folder, [STORE / name for name in ("hello", "clock", "parrot", "voice_mail")], PROFILE)
    robot.microphone = "sound"
    try:
        robot.start()
        hears_hello(robot)
        yield robot
    finally:
        robot.close()
    assert processes_of(folder) == []


def chosen(robot: RobotBehindFaults, since: int) -> set[str]:
    """RApps that were to run, whether a keyword or a long command was taken for them."""
    words = [message.split() for message in robot.messages(since)]
    fetched = {word[2] for word in words if word[:2] == ["core->link", "install"]}
    return fetched | {word[1] for word in words if word[0] == "core:" and word[-1] == "installed"}


def hears_hello(robot: RobotBehindFaults) -> None:
    """A person says a keyword, clearly, until it is heard."""
    since = len(robot.seen)
    for _ in range(5):
        robot.room("personSay", "hello", PERSON)
        try:
            said = robot.until(lambda seen: seen.kind == "said" and seen.detail.startswith("hello Maria"), since, 4.0)
        except AssertionError:
            continue
        robot.until_listening(robot.seen.index(said))
        return
    raise AssertionError(robot.story(since))


def test_in_noise_nothing_wrong_is_started_and_afterwards_it_hears(hearing: RobotBehindFaults) -> None:
    since = len(hearing.seen)
    hearing.room("setNoise", LOUD)
    time.sleep(4.0)
    hearing.room("setNoise", QUIET)
    time.sleep(1.0)
    assert chosen(hearing, since) == set()
    hears_hello(hearing)


def test_two_people_at_once_start_nothing_wrong_and_afterwards_it_hears(hearing: RobotBehindFaults) -> None:
    since = len(hearing.seen)
    words = [("what time is it", "en-us+m3"), ("hello", "en-us+f2")]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda spoken: hearing.room("personSay", *spoken), words))
    time.sleep(1.5)
    assert chosen(hearing, since) <= {"clock", "hello"}
    hears_hello(hearing)
