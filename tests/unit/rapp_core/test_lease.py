"""The lease's bounds, by a clock of its own (DESIGN section 3.1)."""

from pathlib import Path

import pytest

from fakes.agents import FakeAgent, Script
from fakes.clock import Clock
from fakes.rapps import write_rapp
from rapp_core.config import Config
from rapp_core.errors import Refused
from rapp_core.launcher.lease import CRASHED, HANGS, SILENT, Lease
from rapp_core.manifest import read_manifest

LOOK = 1 / 16  # s between two looks, exact in binary


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def lease(clock: Clock) -> Lease:
    return Lease(Config(heartbeat=1.0, hang=10.0), clock.now)


def agent(clock: Clock, tmp_path: Path, **script: object) -> FakeAgent:
    manifest = read_manifest(write_rapp(tmp_path / "package", "probe"))
    return FakeAgent(clock, tmp_path / "run", manifest, Script(terminate=None, **script), [], lambda _m: None)  # type: ignore[arg-type]


def watched(clock: Clock, lease: Lease, seconds: float, serving: bool) -> str | None:
    """What is wrong after a time in which the core agent has looked all the while."""
    problem = None
    for _ in range(round(seconds / LOOK)):
        clock.advance(LOOK)
        problem = lease.problem(serving)
    return problem


def test_only_the_holder_s_secret_is_served(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    run = agent(clock, tmp_path)
    with pytest.raises(Refused):
        lease.check(run.token)
    lease.grant(run)
    assert lease.check(run.token).run is run
    for wrong in ("", "guess", None, 7, run.token + "x", "ł"):
        with pytest.raises(Refused):
            lease.check(wrong)


def test_release_ends_the_lease_and_cuts_what_runs_for_it(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    run = agent(clock, tmp_path)
    lease.grant(run)
    grant = lease.check(run.token)
    assert lease.held
    lease.release()
    assert not lease.held
    assert grant.cut.is_set()
    with pytest.raises(Refused):
        lease.check(run.token)


def test_a_new_lease_does_not_revive_what_was_cut(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    first, second = agent(clock, tmp_path / "1"), agent(clock, tmp_path / "2")
    lease.grant(first)
    cut = lease.check(first.token).cut
    lease.grant(second)
    assert cut.is_set()
    assert not lease.check(second.token).cut.is_set()


def test_a_healthy_holder_is_no_problem(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    lease.grant(agent(clock, tmp_path))
    for _ in range(1000):
        clock.advance(0.05)
        assert lease.problem(serving=False) is None


def test_silence_is_seen_just_after_its_bound(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    lease.grant(agent(clock, tmp_path, silent=2.0))
    assert watched(clock, lease, 1.75, serving=True) is None  # the last heartbeat
    assert watched(clock, lease, 1.0, serving=True) is None
    assert watched(clock, lease, LOOK, serving=True) == SILENT


def test_a_holder_is_not_silent_because_the_core_agent_stood_still(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    lease.grant(agent(clock, tmp_path, silent=2.0, stuck=0.0))
    assert watched(clock, lease, 1.0, serving=False) is None
    clock.advance(20.0)  # nobody looks, nobody reads what was said
    assert lease.problem(serving=False) is None
    assert watched(clock, lease, 1.0, serving=False) is None
    assert watched(clock, lease, LOOK, serving=False) == SILENT


def test_death_is_seen_at_once(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    lease.grant(agent(clock, tmp_path, crash=0.5))
    clock.advance(0.5)
    assert lease.problem(serving=False) == CRASHED


def test_a_loop_that_stands_still_is_seen_though_the_heart_beats(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    lease.grant(agent(clock, tmp_path, stuck=0.0))
    assert watched(clock, lease, 10.0, serving=False) is None
    assert watched(clock, lease, 0.3, serving=False) == HANGS


def test_a_loop_does_not_hang_because_the_core_agent_stood_still(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    lease.grant(agent(clock, tmp_path, stuck=0.0))
    clock.advance(20.0)
    assert watched(clock, lease, 9.9, serving=False) is None
    assert watched(clock, lease, 0.3, serving=False) == HANGS


def test_a_call_of_a_core_service_is_no_standstill(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    lease.grant(agent(clock, tmp_path, stuck=0.0))
    for _ in range(60):
        assert watched(clock, lease, 0.5, serving=True) is None
    assert watched(clock, lease, 9.9, serving=False) is None
    assert watched(clock, lease, 0.2, serving=False) == HANGS


def test_calls_of_threads_beside_the_loop_do_not_hide_its_standstill(clock: Clock, lease: Lease, tmp_path: Path) -> None:
    lease.grant(agent(clock, tmp_path, stuck=0.0, waits=False))
    assert watched(clock, lease, 10.3, serving=True) == HANGS
