"""A RApp that fails again and again."""

import pytest

from fakes.agents import Script
from fakes.core_home import Home, ask
from fakes.rapps import install_rapp


def fails(home: Home, times: int) -> list[str]:
    """Ask that often; gives what was said."""
    for _ in range(times):
        ask(home)
        home.step_until(lambda: home.machine.state == "s9" or home.machine.state == "s11")
        home.step_until(lambda: home.machine.state == "s3")
    return home.fake.said()


def test_l13_a_rapp_that_keeps_failing_is_not_started_for_a_while(home: Home) -> None:
    install_rapp(home.config.home, "clock", keywords=("what time is it",))
    home.agents.script = Script(outcome=("failed", "KeyError: 'name'"))
    home.start()
    *failed, refused = fails(home, 4)
    assert failed == ["It has failed"] * 3
    assert refused.startswith("clock keeps failing, I will not start it before ")
    assert len(home.agents.runs) == 3


@pytest.mark.parametrize(
    "outcome", [("done", ""), ("failed", "Unreachable: cannot reach the platform"), ("failed", "Bug: cannot serve: error 500")]
)
def test_l13_who_succeeds_or_finds_others_away_is_started(home: Home, outcome: tuple[str, str]) -> None:
    install_rapp(home.config.home, "clock", keywords=("what time is it",))
    home.agents.script = Script(outcome=outcome)
    home.start()
    fails(home, 5)
    assert len(home.agents.runs) == 5


def test_l13_a_success_between_them_starts_the_count_anew(home: Home) -> None:
    install_rapp(home.config.home, "clock", keywords=("what time is it",))
    home.start()
    for outcome in (
        ("failed", "ValueError"),
        ("failed", "ValueError"),
        ("done", ""),
        ("failed", "ValueError"),
        ("failed", "ValueError"),
    ):
        home.agents.script = Script(outcome=outcome)
        fails(home, 1)
    assert len(home.agents.runs) == 5
