"""The person stops what the robot does."""

import json
import threading
from collections.abc import Callable

import pytest

from fakes.agents import FakeAgent, Script
from fakes.core_home import BROKEN, QUESTION, Home, ask, ask_what_fits_two, failing_round
from rapp_core.ports import Signal
from rapp_core.trace import Happening

STOP_WORDS = "You have stopped it"


def eventually(condition: Callable[[], bool]) -> None:
    """Wait for what a thread of its own does."""
    waiting = threading.Event()
    assert any(condition() or waiting.wait(0.01) for _ in range(1000))


def lay_hand(home: Home) -> None:
    home.fake.robot.feeling.hand = True
    eventually(home.control._stopping.given)


def begin_to_say_stop(home: Home) -> None:
    eventually(lambda: "stop" in home.fake.body.vocabulary and home.fake.body.listener is not None)
    home.fake.person_says("stop", 0.8, seconds=0.4)


def say_stop(home: Home) -> None:
    begin_to_say_stop(home)
    home.clock.advance(1.0)
    eventually(home.control._stopping.given)


WAYS = pytest.mark.parametrize("stop", [lay_hand, say_stop])


@WAYS
@pytest.mark.parametrize(("state", "rest"), [("s8", ["s10", "s11", "s3"]), ("s9", ["s10", "s11", "s3"]), ("s6", ["s11", "s3"])])
def test_l11_the_person_stops_it_between_the_keyword_and_the_end(
    home: Home, stop: Callable[[Home], None], state: str, rest: list[str]
) -> None:
    home.agents.script = Script(first_word=None if state == "s8" else 0.1, terminate=None)
    home.start()
    ask(home)
    home.step_until(lambda: home.machine.state == state)
    stop(home)
    states, said = failing_round(home)
    assert states[-len(rest) - 1 :] == [state, *rest]
    assert said == [STOP_WORDS]
    assert not any(run.alive for run in home.agents.runs)


@WAYS
def test_l11_an_answer_of_the_platform_is_not_waited_for(home: Home, stop: Callable[[Home], None]) -> None:
    for service in ("interpret", "install"):
        home.link.answers[service] = lambda _: stop(home)
    home.start()
    ask(home, "please tell me how late it is", seconds=2.5, probability=0.1)
    assert failing_round(home) == (["s3", "s5", "s11", "s3"], [STOP_WORDS])
    home.fake.robot.feeling.hand = False
    home.happenings.clear()
    home.happenings.append(Happening("core", "core", "s3", "entered", "listen"))
    ask(home)
    assert failing_round(home) == (["s3", "s4", "s6", "s11", "s3"], [STOP_WORDS] * 2)


@pytest.mark.parametrize("stop", [lay_hand, begin_to_say_stop])
def test_l11_the_person_ends_the_question_which_rapp_is_meant(home: Home, stop: Callable[[Home], None]) -> None:
    ask_what_fits_two(home, None)
    home.clock.after(2.0, lambda: stop(home))
    assert failing_round(home) == (["s3", "s5", "s12", "s11", "s3"], [QUESTION, STOP_WORDS])


def test_l11_a_run_that_is_dismantled_is_not_waited_for(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    hurried: list[bool] = []

    def dismantle(run: FakeAgent, _patience: float, hurry: Signal) -> bool:
        lay_hand(home)
        hurried.append(hurry.is_set() and hurry.wait(0.1))
        return False

    monkeypatch.setattr(FakeAgent, "dismantle", dismantle)
    home.start()
    ask(home)
    assert failing_round(home) == (BROKEN, [STOP_WORDS])
    assert hurried == [True]


def test_l11_while_it_only_listens_the_word_is_none(home: Home) -> None:
    home.start()
    ask(home)
    home.round()
    home.clock.after(1.0, lambda: home.fake.person_says("stop"))
    home.clock.after(5.0, home.stop.set)
    home.machine.step(home.share)
    assert "stop" not in home.fake.body.vocabulary
    assert home.fake.said() == []


def test_l11_what_the_person_has_stopped_has_not_failed(home: Home) -> None:
    home.agents.script = Script(terminate=None, crash=0.5)
    home.start()
    for _ in range(4):
        ask(home)
        home.step_until(lambda: home.machine.state == "s9")
        lay_hand(home)
        home.step_until(lambda: home.machine.state == "s3")
        home.fake.robot.feeling.hand = False
    assert home.fake.said() == [STOP_WORDS] * 4


def test_l11_a_stop_that_comes_after_the_failure_changes_nothing(home: Home) -> None:
    home.agents.script = Script(outcome=("failed", "KeyError: 'name'"))
    home.start()
    ask(home)
    home.step_until(lambda: home.machine.state == "s10")
    lay_hand(home)
    home.step_until(lambda: home.machine.state == "s3")
    assert home.fake.said() == ["It has failed"]
    (entry,) = json.loads((home.config.home / "quarantine.json").read_text()).values()
    assert entry["failures"] == 1
