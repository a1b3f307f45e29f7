"""How a run ends: motion is stopped within its bound, nothing is left, the robot rests."""

import errno
from typing import Any

import pytest

from fakes.agents import FakeAgent, Script
from fakes.core_home import BROKEN, KEYWORD, Home, ask, failing_round
from rapp_core.errors import Refused
from rapp_core.trace import Happening


@pytest.mark.parametrize(
    ("script", "words", "bound"),
    [
        (Script(terminate=None, crash=2.0), "It has crashed", 0.3),
        (Script(terminate=None, silent=2.0), "It does not answer any more", 1.0 + 0.3),
        (Script(terminate=None, stuck=2.0), "It hangs", 10.0 + 0.3),
    ],
    ids=["crashed", "silent", "hung"],
)
def test_motion_is_stopped_within_the_bound_and_before_anything_is_waited_for(
    home: Home, script: Script, words: str, bound: float
) -> None:
    stopped: list[float] = []
    body = home.fake.robot.motion
    stop = body.stop

    def note() -> None:
        stopped.append(home.clock.time)
        stop()

    script.answers_dismantle = False
    home.agents.script = script
    home.start()
    body.stop = note  # type: ignore[method-assign]
    ask(home)
    home.step_until(lambda: bool(home.agents.runs))
    activated = home.clock.time
    states, said = failing_round(home)
    assert (states, said) == (BROKEN, [words])
    assert activated + 1.0 < stopped[0] <= activated + 2.0 + bound
    assert home.fake.journal.index("stop motion") < home.fake.journal.index("end")
    if "dismantle" in home.fake.journal:
        assert home.fake.journal.index("stop motion") < home.fake.journal.index("dismantle")
    assert home.clock.time <= stopped[0] + 2.0  # back in s3


def test_a_loop_ends_with_the_lease(home: Home) -> None:
    def play(agent: FakeAgent) -> None:
        (agent.package).mkdir(parents=True)
        (agent.package / "bell.ogg").write_bytes(b"OggS")
        grant = home.lease.check(agent.token)
        fields = {"path": "/rapp/package/bell.ogg", "position": 0.0, "volume": 1.0, "balance": 0.0, "loop": True}
        home.executor.run_for(grant, "rapp_play_audio", **fields)

    home.agents.script = Script(acts=[(0.5, play)])
    home.start()
    ask(home)
    home.step_until(lambda: home.fake.body.looping is not None)
    home.round()
    assert home.fake.body.looping is None


def test_an_error_nobody_thought_of_ends_the_run_and_is_said(home: Home) -> None:
    def sabotage(agent: FakeAgent) -> None:
        agent.outcome = ()  # type: ignore[assignment]

    home.agents.script = Script(terminate=None, acts=[(0.5, sabotage)])
    home.start()
    ask(home)
    assert home.round()[-2:] == ["s11", "s3"]
    assert home.fake.said() == ["Something went wrong"]
    assert not home.agents.runs[0].alive
    with pytest.raises(Refused):
        home.lease.check(home.agents.runs[0].token)


def test_a_full_disk_leaves_no_spare_but_a_core_agent_that_listens(home: Home, monkeypatch: pytest.MonkeyPatch) -> None:
    def prepare() -> None:
        raise OSError(errno.ENOSPC, "no space left")

    home.start()
    ask(home)
    monkeypatch.setattr(home.agents, "prepare", prepare)
    home.step_until(lambda: home.machine.state == "s11")
    home.step_until(lambda: home.machine.state == "s3")
    assert home.fake.said() == ["Something went wrong"]


def test_a_robot_that_goes_away_is_waited_for(home: Home) -> None:
    home.start()
    home.clock.after(2.0, lambda: setattr(home.fake.body, "here", False))
    home.clock.after(20.0, lambda: setattr(home.fake.body, "here", True))
    home.step_until(lambda: home.clock.time > 25.0)
    home.happenings[:] = home.happenings[:1]
    home.step_until(lambda: home.machine.state == "s3" and home.fake.body.listener is None)
    ask(home)
    assert home.round() == KEYWORD


def test_told_to_end_during_a_run_nothing_is_left(home: Home) -> None:
    home.agents.script = Script(terminate=None)
    home.start()
    ask(home)
    home.step_until(lambda: home.machine.state == "s9")
    home.stop.set()
    home.control.close()
    assert not home.agents.runs[0].alive
    assert home.fake.journal[-5:] == ["stop motion", "stop playing", "hush", "end", "rest"]


def moves(home: Home, **script: Any) -> Script:
    """A dynamic agent that walks."""

    def walk(agent: FakeAgent) -> None:
        home.executor.run_for(home.lease.check(agent.token), "rapp_move_to", x=0.05, y=0.0, theta=0.0)

    return Script(acts=[(0.3, walk)], **script)


@pytest.mark.parametrize(
    "script", [{}, {"outcome": ("failed", "of no use")}, {"terminate": None, "crash": 2.0}, {"terminate": None, "silent": 2.0}]
)
def test_a_rapp_that_moved_the_robot_leaves_it_resting_once(home: Home, script: dict[str, Any]) -> None:
    home.agents.script = moves(home, **script)
    home.start()
    ask(home)
    home.round()
    journal = home.fake.journal
    assert journal.count("rest") == 1
    assert journal.index("stop motion") < journal.index("rest") < journal.index("end")
    home.agents.script = Script()
    ask(home)
    home.happenings.clear()
    home.happenings.append(Happening("core", "core", "s3", "entered", "listen"))
    home.round()
    assert journal.count("rest") == 1


def test_a_rapp_that_moved_nothing_leaves_the_robot_as_it_is(home: Home) -> None:
    home.start()
    ask(home)
    home.round()
    assert "rest" not in home.fake.journal


def test_a_robot_that_cannot_be_let_rest_does_not_keep_the_core_agent(home: Home) -> None:
    home.agents.script = moves(home)
    home.start()
    ask(home)
    home.fake.motion.release = lambda: home.fake.motion.take_posture("none", 1.0)  # type: ignore[method-assign]
    assert home.round() == KEYWORD
