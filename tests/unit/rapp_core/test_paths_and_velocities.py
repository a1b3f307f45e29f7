"""Walks along a path, and walks with a velocity, which go on after the reply."""

import math
import threading
from pathlib import Path
from typing import Any

import numpy
import pytest

from fakes.bench import Bench
from fakes.walking import CONFIG, HAZARDS, along, drive, near, walk
from rapp_core.body_ports import Pose2D
from rapp_core.errors import Invalid, Refused
from rapp_core.services.calls import Call
from rapp_core.services.place import Waypoint


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, **CONFIG)


def test_a_path_is_walked_turning_first_where_the_robot_looks_elsewhere(bench: Bench) -> None:
    along(bench, ("odom", 1.0, 0.0, 0.0), ("odom", 1.0, 1.0, math.pi / 2))
    assert bench.fake.journal == ["moveTo 1.00 0.00 0.00", "moveTo 0.00 0.00 1.57", "moveTo 1.00 0.00 0.00"]
    assert near(bench.fake.motion.pose(), 1.0, 1.0, math.pi / 2)


def test_the_frames_of_a_path(bench: Bench) -> None:
    along(bench, ("odom", 1.0, 0.0, math.pi / 2))
    bench.call("rapp_set_global_pose", pose=Pose2D(10.0, 0.0, 0.0))
    along(bench, ("base_link", 1.0, 0.0, 0.0), ("map", 11.0, 1.0, 0.0))
    assert near(bench.call("rapp_get_robot_pose")["pose"], 11.0, 1.0, 0.0)
    assert near(bench.fake.motion.pose(), 0.0, 1.0, math.pi / 2)


@pytest.mark.parametrize(
    ("poses", "words"),
    [
        ([], "0 poses"),
        ([("odom", 0.0, 0.0, 0.0)] * 101, "101 poses"),
        ([("odom", 0.1, 0.0, 0.0), ("moon", 0.0, 0.0, 0.0)], "pose 2 in frame 'moon': known are map, odom, base_link"),
        ([("odom", math.nan, 0.0, 0.0)], "pose 1"),
    ],
)
def test_a_path_of_no_use_is_invalid_before_anything_moves(bench: Bench, poses: Any, words: str) -> None:
    with pytest.raises(Invalid, match=words):
        along(bench, *poses)
    assert bench.fake.journal == []


def test_the_length_of_a_whole_path_counts(bench: Bench) -> None:
    with pytest.raises(Refused, match=r"12\.0 m"):
        along(bench, ("odom", 6.0, 0.0, 0.0), ("odom", 0.0, 0.0, 0.0))


def test_a_path_tells_the_poses_behind_the_robot(bench: Bench) -> None:
    told: list[dict[str, Any]] = []
    poses = [Waypoint("odom", Pose2D(x, 0.0, 0.0)) for x in (0.5, 1.0, 1.5)]
    bench.goal("rapp_move_along_path", Call(lambda values: told.append(dict(values))), poses=poses)
    assert {each["reached"] for each in told} == {0, 1, 2}
    assert told[-1]["pose"].x > 1.3


def test_move_vel_answers_at_once_and_walks_until_it_is_stopped(bench: Bench) -> None:
    drive(bench, 0.1, 0.0, 0.1)
    assert (bench.clock.time, bench.fake.journal) == (0.0, [])
    bench.clock.at(4.0, lambda: bench.call("rapp_move_stop"))
    bench.go_on()
    assert bench.fake.journal[0] == "move 0.1 0 0.1"
    assert bench.clock.time <= 4.0 + 0.03
    assert not bench.fake.motion.moving()


def test_move_vel_starts_from_stand_init(bench: Bench) -> None:
    bench.fake.motion.at = "Stand"
    drive(bench)
    bench.clock.at(4.0, bench.cut.set)
    bench.go_on()
    assert bench.fake.journal == ["posture StandInit at 0.6", "move 0.1 0 0", "cancel"]


def test_a_further_move_vel_changes_the_velocity_without_a_stop(bench: Bench) -> None:
    drive(bench)
    bench.clock.at(2.0, lambda: drive(bench, 0.0, 0.05, 0.0))
    bench.clock.at(4.0, bench.cut.set)
    bench.go_on()
    assert bench.fake.journal == ["move 0.1 0 0", "move 0 0.05 0", "cancel"]
    assert (bench.fake.motion.pose().x, bench.fake.motion.pose().y) == pytest.approx((0.2, 0.1), abs=0.01)


def test_a_further_move_vel_of_no_use_changes_nothing(bench: Bench) -> None:
    drive(bench)

    def wrong() -> None:
        with pytest.raises(Invalid):
            drive(bench, math.nan)

    bench.clock.at(2.0, wrong)
    bench.clock.at(4.0, bench.cut.set)
    bench.go_on()
    assert bench.fake.journal == ["move 0.1 0 0", "cancel"]


@pytest.mark.parametrize("words", HAZARDS)
def test_a_hazard_stops_move_vel_and_is_told_in_the_trace(bench: Bench, words: str) -> None:
    drive(bench)
    bench.clock.at(3.0, lambda: bench.fake.feeling.feel(**HAZARDS[words]))
    bench.go_on()
    assert 3.0 <= bench.clock.time <= 3.1
    assert bench.fake.journal[-1] == "cancel"
    assert bench.messages()[-1].startswith("core: rapp_move_vel: cannot walk")


def test_what_has_ended_move_vel_is_told_its_caller_once_and_nobody_else(bench: Bench) -> None:
    drive(bench)
    bench.clock.at(3.0, lambda: bench.fake.feeling.feel(sonar=(0.25, math.inf)))
    bench.go_on()
    mine, bench.cut = bench.cut, bench.clock.event()
    assert bench.call("rapp_move_stop") == {"message": ""}
    bench.cut = mine
    assert bench.call("rapp_move_vel", x=0.0, y=0.0, theta=0.2)["message"].startswith("cannot walk: there is an obstacle 0.25 m")
    bench.clock.after(1.0, lambda: bench.call("rapp_move_stop"))
    bench.go_on()
    assert bench.call("rapp_move_stop") == {"message": ""}


@pytest.mark.parametrize("wrong", [{"x": 0.11}, {"x": -0.11}, {"y": 0.07}, {"theta": 0.6}])
def test_a_velocity_beyond_the_limits_is_refused_and_the_limits_named(bench: Bench, wrong: dict[str, float]) -> None:
    with pytest.raises(Refused, match=rf"with {next(iter(wrong))} .* are allowed"):
        drive(bench, **{"x": 0.0, **wrong})
    assert bench.aside == []


def test_single_precision_does_not_make_a_greatest_velocity_too_great(bench: Bench) -> None:
    drive(bench, float(numpy.float32(0.1)), float(numpy.float32(0.06)), 0.5)


def test_the_next_motion_of_the_legs_ends_move_vel(tmp_path: Path) -> None:
    bench = Bench(tmp_path, **CONFIG)
    drive(bench)
    (work,) = bench.aside
    other = threading.Thread(target=work)
    other.start()
    walk(bench, 0.5)
    other.join(10)
    assert bench.fake.journal == ["move 0.1 0 0", "cancel", "moveTo 0.50 0.00 0.00"]
    drive(bench)
    assert len(bench.aside) == 2
