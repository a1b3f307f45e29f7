"""Versions that fail again and again: how long they are not started, and what ends that."""

import json
import time
from dataclasses import replace
from pathlib import Path

import pytest

from rapp_core.config import Config
from rapp_core.control.quarantine import FILE, Quarantine
from rapp_core.files import aside_of

NOON = time.mktime((2026, 11, 21, 12, 0, 0, 0, 0, -1))


class Home:
    """A robot's folder, and the time on its clock."""

    def __init__(self, folder: Path) -> None:
        self.config = Config(home=folder, failures=3, quarantine=60.0, quarantine_longest=600.0)
        self.now = NOON
        self.restart()

    def restart(self) -> None:
        self.quarantine = Quarantine(self.config, lambda: self.now)

    def fail(self, times: int = 1, version: str = "1.0.0") -> None:
        for _ in range(times):
            self.quarantine.failed("clock", version, "it has crashed")

    def refusal(self, version: str = "1.0.0") -> str | None:
        return self.quarantine.refusal("clock", version)

    def refused_for(self) -> float:
        """Seconds from now until it may be started."""
        begun = self.now
        while self.refusal() is not None:
            self.now += 1.0
        return self.now - begun


@pytest.fixture
def home(tmp_path: Path) -> Home:
    return Home(tmp_path)


def test_fewer_failures_than_the_bound_say_nothing(home: Home) -> None:
    home.fail(2)
    assert home.refusal() is None


def test_each_further_failure_doubles_the_time_up_to_the_longest(home: Home) -> None:
    home.fail(2)
    times = []
    for _ in range(6):
        home.fail()
        times.append(home.refused_for())
    assert times == [60, 120, 240, 480, 600, 600]


def test_it_says_until_when(home: Home) -> None:
    home.fail(3)
    assert home.refusal() == "clock keeps failing, I will not start it before 12:01"
    home.now += 12 * 3600 - 30
    home.fail()
    assert home.refusal() == "clock keeps failing, I will not start it before tomorrow 00:02"


def test_a_day_later_than_tomorrow_has_its_name(tmp_path: Path) -> None:
    home = Home(tmp_path)
    home.config = replace(home.config, quarantine_longest=2 * 86400.0, quarantine=2 * 86400.0)
    home.restart()
    home.fail(3)
    assert home.refusal() == "clock keeps failing, I will not start it before Monday 12:00"


def test_those_in_quarantine_are_listed(home: Home) -> None:
    home.fail(2)
    assert home.quarantine.present() == {}
    home.fail()
    assert [(name, entry.failures) for name, entry in home.quarantine.present().items()] == [("clock", 3)]
    home.now += 60
    assert home.quarantine.present() == {}


def test_another_rapp_and_another_version_are_free(home: Home) -> None:
    home.fail(3)
    assert home.quarantine.refusal("parrot", "1.0.0") is None
    assert home.refusal("1.0.1") is None
    home.fail(version="1.0.1")
    assert home.refusal("1.0.1") is None


def test_a_success_ends_it_and_the_count(home: Home) -> None:
    home.fail(3)
    assert [home.quarantine.forget("clock") for _ in range(2)] == [True, False]
    assert home.refusal() is None
    home.fail(2)
    assert home.refusal() is None


def test_a_core_agent_that_was_started_anew_knows_it(home: Home) -> None:
    home.fail(3)
    home.restart()
    assert home.refusal() is not None
    assert sorted(path.name for path in home.config.home.iterdir()) == [FILE]


def test_a_clock_that_went_back_ends_it(home: Home) -> None:
    home.fail(3)
    home.now -= 1e8
    assert home.refusal() is None


INFINITE = '{"clock": {"version": "1.0.0", "failures": %s, "since": 0, "until": %s, "why": ""}}'


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        '{"clock": 1}',
        '{"clock": {"version": "1.0.0"}}',
        INFINITE % ("1e999", 1),
        INFINITE % (3, "Infinity"),
        INFINITE % (3, 1e300),
    ],
)
def test_what_cannot_be_read_keeps_nothing_from_being_started(home: Home, text: str) -> None:
    (home.config.home / FILE).write_text(text)
    assert home.refusal() is None
    home.fail(3)
    assert home.refusal() is not None


def test_what_cannot_be_written_is_no_matter(tmp_path: Path) -> None:
    quarantine = Quarantine(Config(home=tmp_path / "away"))
    quarantine.failed("clock", "1.0.0", "it has crashed")
    assert quarantine.refusal("clock", "1.0.0") is None


def test_what_cannot_be_forgotten_is_told(home: Home) -> None:
    home.fail(3)
    aside_of(home.config.home / FILE).mkdir()
    with pytest.raises(OSError):
        home.quarantine.forget("clock")
    assert home.refusal() is not None


def test_what_is_kept_can_be_read_by_people(home: Home) -> None:
    home.fail(3)
    (entry,) = json.loads((home.config.home / FILE).read_text()).values()
    assert entry == {"version": "1.0.0", "failures": 3, "since": NOON, "until": NOON + 60, "why": "it has crashed"}
