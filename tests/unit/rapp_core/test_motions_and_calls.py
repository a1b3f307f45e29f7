"""Motions and the calls that wait for them: stopped, ended with the lease, waiting for limbs, taken over, told how far they are."""

import math
from pathlib import Path
from typing import Any

import pytest

from fakes.bench import Bench
from fakes.walking import CONFIG, walk
from rapp_core.body_ports import Pose2D
from rapp_core.errors import CoreError, Invalid, Refused, Unreachable
from rapp_core.services.calls import Call
from rapp_core.services.place import Waypoint


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, **CONFIG)


MOTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "walk": ("rapp_move_to", {"x": 5.0, "y": 0.0, "theta": 0.0}),
    "path": ("rapp_move_along_path", {"poses": [Waypoint("odom", Pose2D(5.0, 0.0, 0.0))]}),
    "posture": ("rapp_take_predefined_posture", {"posture": "Sit", "speed": 0.0}),
    "joint": ("rapp_move_joint", {"joints": ["HeadYaw"], "angles": [0.5], "speed": 0.0}),
    "look": ("rapp_look_at_point", {"x": 1.0, "y": 0.0, "z": 0.4}),
    "rest": ("rapp_rest", {"posture": ""}),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_move_stop_ends_a_motion_at_once_and_its_caller_is_told(bench: Bench, name: str) -> None:
    service, request = MOTIONS[name]
    bench.clock.at(0.5, lambda: bench.call("rapp_move_stop"))
    with pytest.raises(Refused, match="stopped"):
        bench.call(service, **request)
    assert bench.clock.time <= 0.5 + 0.03
    assert "stop motion" in bench.fake.journal
    assert not bench.fake.motion.moving()


@pytest.mark.parametrize("name", MOTIONS)
def test_the_end_of_the_lease_ends_a_motion(bench: Bench, name: str) -> None:
    service, request = MOTIONS[name]
    bench.clock.at(0.5, bench.cut.set)
    with pytest.raises(Refused, match="lease"):
        bench.call(service, **request)
    assert bench.clock.time <= 0.5 + 0.03
    assert bench.fake.journal[-1] == "cancel"


def test_move_stop_of_a_still_robot_is_no_error_and_ends_nothing_else(bench: Bench) -> None:
    bench.clock.at(0.5, lambda: bench.call("rapp_move_stop"))
    bench.call("rapp_record", duration=1.0)
    assert "stop motion" in bench.fake.journal


def test_a_robot_that_is_away_cannot_be_stopped_and_the_caller_is_told(bench: Bench) -> None:
    bench.fake.body.here = False
    with pytest.raises(Unreachable):
        bench.call("rapp_move_stop")


def test_limbs_that_are_not_needed_are_free_for_another_motion(bench: Bench) -> None:
    done: list[float] = []

    def look() -> None:
        bench.call("rapp_look_at_point", x=1.0, y=0.5, z=0.3)
        done.append(bench.clock.time)

    bench.clock.at(1.0, look)
    walk(bench)
    assert done[0] < bench.clock.time


def test_a_call_waits_for_limbs_and_says_which(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rapp_core.services.executor.PATIENCE", 0.0)
    errors: list[str] = []

    def second() -> None:
        try:
            bench.call("rapp_take_predefined_posture", posture="Sit", speed=0.0)
        except CoreError as error:
            errors.append(str(error))

    bench.clock.at(1.0, second)
    walk(bench)
    assert errors == ["cannot run rapp_take_predefined_posture: the legs is in use; wait for the other call"]


def test_a_goal_ends_what_moves_the_same_limbs(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rapp_core.services.executor.PATIENCE", 0.0)
    newer = Call()

    def arrive() -> None:  # its own thread would wait until the older has given way
        with pytest.raises(Refused, match="in use"):
            bench.goal("rapp_move_to", newer, x=0.1, y=0.0, theta=0.0)

    bench.clock.at(1.0, arrive)
    with pytest.raises(Refused, match="another call has taken over"):
        walk(bench)
    bench.goal("rapp_move_to", newer, x=0.1, y=0.0, theta=0.0)
    assert bench.fake.journal == ["moveTo 1.00 0.00 0.00", "cancel", "moveTo 0.10 0.00 0.00"]


USELESS: dict[str, tuple[str, dict[str, Any]]] = {
    "walk": ("rapp_move_to", {"x": math.nan, "y": 0.0, "theta": 0.0}),
    "far walk": ("rapp_move_to", {"x": 11.0, "y": 0.0, "theta": 0.0}),
    "velocity": ("rapp_move_vel", {"x": math.nan, "y": 0.0, "theta": 0.0}),
    "fast": ("rapp_move_vel", {"x": 1.0, "y": 0.0, "theta": 0.0}),
    "path": ("rapp_move_along_path", {"poses": []}),
    "far path": ("rapp_move_along_path", {"poses": [Waypoint("odom", Pose2D(x, 0.0, 0.0)) for x in (1.0, 7.0, 1.0)]}),
    "posture": ("rapp_take_predefined_posture", {"posture": "Headstand", "speed": 0.0}),
    "joint": ("rapp_move_joint", {"joints": ["LKneePitch"], "angles": [9.0], "speed": 0.0}),
    "look": ("rapp_look_at_point", {"x": math.nan, "y": 0.0, "z": 0.0}),
    "rest": ("rapp_rest", {"posture": "Stand"}),
}


@pytest.mark.parametrize("as_goal", [False, True])
@pytest.mark.parametrize("name", USELESS)
def test_a_request_of_no_use_ends_no_motion(bench: Bench, name: str, as_goal: bool) -> None:
    service, request = USELESS[name]

    def ask() -> None:
        with pytest.raises((Invalid, Refused)):
            bench.goal(service, Call(), **request) if as_goal else bench.call(service, **request)

    bench.call("rapp_move_vel", x=0.1, y=0.0, theta=0.0)
    bench.clock.at(2.0, ask)
    bench.clock.at(4.0, bench.cut.set)
    bench.go_on()
    assert bench.fake.journal == ["move 0.1 0 0", "cancel"]
    assert bench.clock.time >= 4.0


def test_a_goal_of_use_ends_the_older_of_its_action_and_one_of_no_use_does_not(bench: Bench) -> None:
    first = Call()
    with pytest.raises(Invalid):
        bench.goal("rapp_move_to", Call(older=[first]), x=math.nan, y=0.0, theta=0.0)
    assert not first.ended
    bench.goal("rapp_move_to", Call(older=[first]), x=0.1, y=0.0, theta=0.0)
    assert first.ended
    bench.clock.after(0.5, lambda: ask_too_late(bench, first))
    bench.goal("rapp_move_to", Call(), x=0.1, y=0.0, theta=0.0)


def ask_too_late(bench: Bench, ended: Call) -> None:
    with pytest.raises(Refused, match="taken over"):
        bench.goal("rapp_move_to", ended, x=0.1, y=0.0, theta=0.0)


def test_a_goal_is_told_how_far_it_is(bench: Bench) -> None:
    told: list[dict[str, Any]] = []
    bench.fake.motion.move_to(2.0, 1.0, math.pi / 2).wait(60.0)
    bench.goal("rapp_move_to", Call(lambda values: told.append(dict(values))), x=1.0, y=0.0, theta=0.0)
    ways = [each["x"] for each in told]
    assert ways == sorted(ways)
    assert len(ways) == pytest.approx(50, rel=0.2)
    assert all(abs(each["y"]) < 1e-6 and abs(each["theta"]) < 1e-6 for each in told)
