"""The first start of a new version of a RApp: what the link is told of it, and what the person."""

import os
from pathlib import Path
from typing import Any

import pytest

from fakes.link import FakeLink
from fakes.rapps import write_rapp
from rapp_core.control.trial import Trial
from rapp_core.errors import Unreachable
from rapp_core.trace import Happening, Trace

BACK = "The new version did not start, the one before is back"


class Home:
    """The RApp clock, whose version 2.0.0 has not started yet."""

    def __init__(self, folder: Path) -> None:
        self.rapp = folder / "rapps" / "clock"
        for version in ("1.0.0", "2.0.0"):
            write_rapp(self.rapp / version, "clock", version=version)
        (self.rapp / "previous").symlink_to("1.0.0")
        (self.rapp / "current").symlink_to("2.0.0")
        self.link = FakeLink()
        self.link.answers["started"] = lambda told: {"back": None if told["ok"] else "1.0.0"}
        self.trace = Trace()
        self.happenings: list[Happening] = []
        self.trace.listen(self.happenings.append)
        self.trial = Trial(self.link, self.trace)

    def begin(self, version: str = "2.0.0") -> None:
        self.trial.begin(self.rapp / version)

    def enters(self, *states: str, machine: str = "dynamic") -> None:
        for state in states:
            self.trial.told({"type": "state", "machine": machine, "state": state, "kind": "entered", "detail": ""})

    @property
    def told(self) -> list[dict[str, Any]]:
        return [arguments for name, arguments in self.link.asked if name == "started"]


@pytest.fixture
def home(tmp_path: Path) -> Home:
    return Home(tmp_path)


def test_without_a_first_word_the_one_before_comes_back_and_the_person_is_told(home: Home) -> None:
    home.begin()
    home.trial.failed("SyntaxError: invalid syntax")
    assert home.trial.end("r1", spoken=False) == BACK
    assert home.told == [{"run": "r1", "name": "clock", "version": "2.0.0", "ok": False, "detail": "SyntaxError: invalid syntax"}]
    assert home.happenings[-1].detail == "core: clock 2.0.0 did not start (SyntaxError: invalid syntax), 1.0.0 is back"


def test_a_version_that_fails_while_it_initialises_has_not_started(home: Home) -> None:
    home.begin()
    home.enters("s1", "s2", "s4")
    home.trial.failed("KeyError: 'city'")
    assert home.trial.end("r1", spoken=True) == BACK


@pytest.mark.parametrize("states", [(), ("s1", "s2", "s3"), ("s1", "s2", "s3", "s4", "s5")])
def test_what_fails_later_has_started(home: Home, states: tuple[str, ...]) -> None:
    home.begin()
    home.enters(*states)
    home.enters("s2", machine="execute")  # a state of its own that is called so
    home.trial.failed("the mail server was away")
    assert home.trial.end("r1", spoken=True) is None
    assert [told["ok"] for told in home.told] == [True]


def test_what_is_not_the_rapp_s_fault_says_nothing_of_it(home: Home) -> None:
    home.begin()
    assert home.trial.end("r1", spoken=False) is None
    home.begin()
    home.enters("s1", "s2")
    assert home.trial.end("r2", spoken=True) is None
    assert home.told == []


def test_only_a_version_on_trial_is_told_of(home: Home) -> None:
    for version in ("1.0.0", "2.0.0"):
        home.begin(version)
        (home.rapp / "previous").unlink(missing_ok=True)
        home.trial.failed("it has failed")
        assert home.trial.end("r1", spoken=False) is None
    assert home.told == []


def test_while_the_link_is_away_the_version_stays_on_trial(home: Home) -> None:
    home.begin()
    home.trial.failed("no first word")
    home.link.errors["started"] = Unreachable("cannot started: the link was lost")
    assert home.trial.end("r1", spoken=False) is None
    home.link.errors.clear()
    home.begin()
    home.trial.failed("no first word")
    assert home.trial.end("r2", spoken=False) == BACK


def test_one_start_knows_nothing_of_the_one_before(home: Home) -> None:
    home.begin()
    home.enters("s1", "s2")
    home.trial.failed("no first word")
    home.begin()
    assert home.trial.end("r2", spoken=True) is None
    assert home.told[-1]["ok"]


def test_a_start_shows_when_the_rapp_was_used_last(home: Home) -> None:
    os.utime(home.rapp / "2.0.0", (1000, 1000))
    home.begin()
    assert (home.rapp / "2.0.0").stat().st_mtime > 1000
