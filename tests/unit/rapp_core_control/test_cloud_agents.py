"""A RApp of four agents (deliverable section 3.2), as the core agent starts and ends it."""

import pytest

from fakes.agents import Script
from fakes.core_home import KEYWORD, Home, ask, failing_round
from fakes.rapps import write_rapp
from rapp_core.errors import Bug, Refused, Unreachable


def with_cloud_agent(home: Home) -> None:
    """The clock's package has a cloud agent, which the link starts and stops."""
    package = write_rapp(home.config.home.parent / "four" / "clock", "clock", keywords=("what time is it",), partner="clock_cloud")
    home.link.shelf["clock"] = package
    home.link.answers = {"start_cloud_agent": {"agent": "0"}, "stop_cloud_agent": {"stopped": True}}
    home.start()


def cloud_requests(home: Home) -> list[str]:
    return [name for name in home.link.names() if name.endswith("cloud_agent")]


def test_a_four_agent_rapp_has_its_cloud_agent_started_and_stopped(home: Home) -> None:
    with_cloud_agent(home)
    journal = home.fake.journal
    home.link.answers["stop_cloud_agent"] = lambda _: journal.append("stop cloud agent") or {"stopped": True}
    ask(home)
    assert home.round() == KEYWORD
    assert ("start_cloud_agent", {"rapp": "clock", "version": "1.0.0", "run": "0"}) in home.link.asked
    assert cloud_requests(home) == ["start_cloud_agent", "stop_cloud_agent"]
    assert journal.index("dismantle") < journal.index("stop cloud agent") < journal.index("end")


def test_a_three_agent_rapp_asks_for_no_cloud_agent(home: Home) -> None:
    home.start()
    ask(home)
    assert home.round() == KEYWORD
    assert cloud_requests(home) == []


def test_a_cloud_agent_that_its_dynamic_agent_has_stopped_is_not_stopped_twice(home: Home) -> None:
    with_cloud_agent(home)
    home.agents.script = Script(acts=[(0.5, lambda agent: home.cloud_agents.stop(agent, 5.0))])
    ask(home)
    assert home.round() == KEYWORD
    assert cloud_requests(home) == ["start_cloud_agent", "stop_cloud_agent"]


@pytest.mark.parametrize(
    "script", [Script(terminate=None, crash=0.5), Script(terminate=None, silent=0.5)], ids=["crashed", "silent"]
)
def test_when_the_dynamic_agent_cannot_the_core_agent_stops_its_cloud_agent(home: Home, script: Script) -> None:
    with_cloud_agent(home)
    home.agents.script = script
    ask(home)
    assert home.round()[-2:] == ["s11", "s3"]
    assert cloud_requests(home) == ["start_cloud_agent", "stop_cloud_agent"]


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (Unreachable("cannot reach the platform"), "I cannot reach the platform"),
        (Refused("cannot confine a cloud agent here"), "I cannot start its part in the cloud"),
        (Bug("cannot start clock_cloud: SyntaxError"), "I cannot start its part in the cloud"),
    ],
)
def test_a_cloud_agent_that_does_not_start_fails_its_rapp_aloud(home: Home, error: Unreachable | Refused | Bug, words: str) -> None:
    with_cloud_agent(home)
    home.link.errors["start_cloud_agent"] = error
    home.agents.script = Script(terminate=None)
    ask(home)
    states, said = failing_round(home)
    assert states[-3:] == ["s10", "s11", "s3"]
    assert said == [words]


def test_a_cloud_agent_that_cannot_be_stopped_does_not_keep_the_robot(home: Home) -> None:
    with_cloud_agent(home)
    home.link.errors["stop_cloud_agent"] = Unreachable("cannot reach the link")
    ask(home)
    assert home.round() == KEYWORD
    assert not home.agents.runs[0].alive


def test_the_link_is_told_that_no_run_lives_at_the_start_and_at_the_end(home: Home) -> None:
    with_cloud_agent(home)
    assert home.link.kept == [""]
    home.agents.script = Script(terminate=None)
    ask(home)
    home.step_until(lambda: home.machine.state == "s9")
    home.stop.set()
    home.control.close()
    assert home.link.kept[-1] == ""
