"""The services that walk: what they ask of the robot, what they refuse, what stops them, and that they can be stopped."""

import math
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy
import pytest

from fakes.bench import Bench
from fakes.robot_body import FakeMovement
from rapp_core.body_ports import Pose2D
from rapp_core.errors import CoreError, Invalid, Refused, Unreachable
from rapp_core.services.calls import Call
from rapp_core.services.place import Waypoint

CONFIG = {"motion_time": 300.0, "walk_distance": 10.0, "near": 0.3, "walk_speed": 0.1, "side_speed": 0.06, "turn_speed": 0.5}


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, **CONFIG)


def walk(bench: Bench, x: float = 1.0, y: float = 0.0, theta: float = 0.0) -> None:
    bench.call("rapp_move_to", x=x, y=y, theta=theta)


def along(bench: Bench, *poses: tuple[str, float, float, float]) -> None:
    bench.call("rapp_move_along_path", poses=[Waypoint(frame, Pose2D(*pose)) for frame, *pose in poses])


def drive(bench: Bench, x: float = 0.1, y: float = 0.0, theta: float = 0.0) -> None:
    bench.call("rapp_move_vel", x=x, y=y, theta=theta)


def near(pose: Pose2D, x: float, y: float, theta: float) -> bool:
    return (pose.x, pose.y, pose.theta) == pytest.approx((x, y, theta), abs=1e-6)


# moveTo


def test_move_to_walks_and_returns_when_it_is_there(bench: Bench) -> None:
    walk(bench, 1.0, 0.0, 0.5)
    assert bench.fake.journal == ["moveTo 1.00 0.00 0.50"]
    assert bench.states() == ["/check", "/walk", "/arrived"]
    assert bench.messages() == ["core->ALMotion moveTo", "ALMotion->core reply moveTo"]
    assert bench.clock.time == pytest.approx(10.0, abs=0.1)
    assert near(bench.fake.motion.pose(), 1.0, 0.0, 0.5)


@pytest.mark.parametrize("posture", ["Crouch", "Sit"])
def test_a_robot_that_does_not_stand_stands_up_first(bench: Bench, posture: str) -> None:
    bench.fake.motion.at = posture
    walk(bench, 0.1)
    assert bench.fake.journal == ["posture StandInit at 0.6", "moveTo 0.10 0.00 0.00"]


def test_what_the_robot_is_asked_and_answers_is_told(bench: Bench) -> None:
    bench.fake.motion.at = "Crouch"
    along(bench, ("base_link", 0.0, 0.5, 0.0))
    asked = [f"core->{module} {method}" for module, method in (("ALRobotPosture", "goToPosture"), *[("ALMotion", "moveTo")] * 2)]
    answered = [message.replace("core->", "").replace(" ", "->core reply ", 1) for message in asked]
    pairs = [text for pair in zip(asked, answered, strict=True) for text in pair]
    assert [message for message in bench.messages() if "AL" in message] == pairs


@pytest.mark.parametrize("theta", [math.tau + 0.5, 0.5 - math.tau])
def test_more_than_a_turn_is_the_turn_that_is_left(bench: Bench, theta: float) -> None:
    walk(bench, 0.0, 0.0, theta)
    assert bench.fake.journal == ["moveTo 0.00 0.00 0.50"]


@pytest.mark.parametrize("wrong", [{"x": math.nan}, {"y": math.inf}, {"theta": -math.inf}])
def test_what_is_no_number_is_invalid_before_anything_moves(bench: Bench, wrong: dict[str, float]) -> None:
    with pytest.raises(Invalid, match="numbers"):
        walk(bench, **wrong)
    assert bench.fake.journal == []


def test_too_far_is_refused_before_anything_moves(bench: Bench) -> None:
    with pytest.raises(Refused, match="10 m at a time"):
        walk(bench, 8.0, 8.0)
    assert bench.fake.journal == []


def test_a_robot_that_does_not_come_to_its_goal_is_not_said_to_have(bench: Bench) -> None:
    bench.fake.motion.slip = 0.5
    with pytest.raises(Refused, match=r"stopped 0\.50 m"):
        walk(bench)


def test_a_robot_that_ends_its_walk_by_itself_is_told_of(bench: Bench) -> None:
    bench.clock.at(3.0, bench.fake.motion.stop)
    with pytest.raises(Refused, match="by itself"):
        walk(bench)


def test_why_a_robot_has_ended_its_walk_by_itself_is_told_where_it_is_felt(bench: Bench) -> None:
    def protect() -> None:
        bench.fake.feeling.feel(bumpers=(False, True))
        bench.fake.motion.stop()

    for begin in (walk, drive):
        bench.fake.feeling.feel(bumpers=(False, False))
        bench.clock.after(3.01, protect)
        if begin is walk:
            with pytest.raises(Refused, match="bumper of the right"):
                walk(bench)
        else:
            drive(bench)
            bench.go_on()
            assert "bumper of the right" in bench.messages()[-1]


def test_a_walk_that_takes_too_long_is_ended(tmp_path: Path) -> None:
    bench = Bench(tmp_path, **{**CONFIG, "motion_time": 5.0})
    with pytest.raises(Refused, match="more than 5 s"):
        walk(bench)
    assert bench.fake.journal[-1] == "cancel"
    assert not bench.fake.motion.moving()


def test_a_robot_that_goes_away_is_unreachable(bench: Bench) -> None:
    bench.clock.at(2.0, lambda: setattr(bench.fake.body, "here", False))
    with pytest.raises(Unreachable):
        walk(bench)


# reflexes

HAZARDS: dict[str, dict[str, Any]] = {
    "bumper of the left": {"bumpers": (True, False)},
    "bumper of the right": {"bumpers": (False, True)},
    r"0\.25 m ahead, seen by the right": {"sonar": (math.inf, 0.25)},
    "fallen": {"fallen": True},
}
WALKS: dict[str, Callable[[Bench], None]] = {
    "move_to": walk,
    "move_along_path": lambda bench: along(bench, ("base_link", 1.0, 0.0, 0.0)),
}


@pytest.mark.parametrize("name", WALKS)
@pytest.mark.parametrize("words", HAZARDS)
def test_a_hazard_stops_a_walk_and_is_named(bench: Bench, name: str, words: str) -> None:
    bench.clock.at(3.0, lambda: bench.fake.feeling.feel(**HAZARDS[words]))
    with pytest.raises(Refused, match=words):
        WALKS[name](bench)
    assert 3.0 <= bench.clock.time <= 3.1
    assert bench.fake.journal[-1] == "cancel"
    assert not bench.fake.motion.moving()


@pytest.mark.parametrize("words", HAZARDS)
def test_with_a_hazard_no_walk_begins(bench: Bench, words: str) -> None:
    bench.fake.feeling.feel(**HAZARDS[words])
    for begin in (*WALKS.values(), drive):
        with pytest.raises(Refused, match=words):
            begin(bench)
    assert bench.fake.journal == []
    assert bench.aside == []


def test_an_obstacle_ahead_is_no_hazard_for_who_steps_back_turns_or_steps_aside(bench: Bench) -> None:
    bench.fake.feeling.feel(sonar=(0.2, 0.2))
    walk(bench, -0.2)
    walk(bench, 0.0, 0.0, 1.0)
    walk(bench, 0.0, 0.2)


def test_who_has_met_something_may_step_back_only(bench: Bench) -> None:
    bench.fake.feeling.feel(bumpers=(True, True))
    walk(bench, -0.2)
    for way in ({"x": 0.2}, {"x": 0.0, "theta": 1.0}):
        with pytest.raises(Refused, match="bumper"):
            walk(bench, **way)


def test_a_walking_robot_is_felt_twenty_times_a_second(bench: Bench) -> None:
    walk(bench)
    assert bench.fake.feeling.asked == pytest.approx(200, rel=0.25)


# stop, lease, the next motion

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


def test_a_goal_is_told_how_far_it_is(bench: Bench) -> None:
    told: list[dict[str, Any]] = []
    bench.fake.motion.move_to(2.0, 1.0, math.pi / 2).wait(60.0)
    bench.goal("rapp_move_to", Call(lambda values: told.append(dict(values))), x=1.0, y=0.0, theta=0.0)
    ways = [each["x"] for each in told]
    assert ways == sorted(ways)
    assert len(ways) == pytest.approx(50, rel=0.2)
    assert all(abs(each["y"]) < 1e-6 and abs(each["theta"]) < 1e-6 for each in told)


# moveAlongPath


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


# moveVel


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


def leave(bench: Bench, posture: str = "Crouch") -> list[str]:
    """What the robot is told at the end of a run that has found it in a posture, and left it standing."""
    bench.fake.motion.at = posture
    bench.call("rapp_take_predefined_posture", posture="StandInit", speed=0.0)
    bench.fake.journal.clear()
    bench.executor.put_back()
    bench.go_on()
    return bench.fake.journal


@pytest.mark.parametrize("posture", ["Crouch", "Sit", "LyingBelly"])
def test_a_robot_that_was_moved_is_brought_back_to_its_posture_without_motors(bench: Bench, posture: str) -> None:
    assert leave(bench, posture) == [f"posture {posture} at 0.6", "relax"]
    assert (bench.fake.motion.at, bench.fake.motion.awake) == (posture, False)


@pytest.mark.parametrize("posture", ["Stand", "StandInit", "Unknown"])
def test_a_posture_that_needs_motors_is_not_gone_back_to(bench: Bench, posture: str) -> None:
    assert leave(bench, posture) == ["rest"]


def test_a_robot_that_has_fallen_is_not_made_to_get_up(bench: Bench) -> None:
    bench.fake.feeling.feel(fallen=True)
    assert leave(bench, "Sit") == ["rest"]


def test_it_is_brought_back_once_and_not_when_nothing_has_moved_it(bench: Bench) -> None:
    leave(bench)
    bench.fake.journal.clear()
    bench.call("rapp_get_robot_pose")
    bench.call("rapp_move_stop")
    bench.fake.journal.clear()
    bench.executor.put_back()
    assert (bench.fake.journal, bench.aside) == ([], [])


def test_the_next_motion_ends_the_way_back_and_the_posture_is_not_forgotten(tmp_path: Path) -> None:
    bench = Bench(tmp_path, **CONFIG)
    bench.fake.motion.at = "Sit"
    bench.call("rapp_take_predefined_posture", posture="StandInit", speed=0.0)
    bench.executor.put_back()
    taking, take_posture = threading.Event(), bench.fake.motion.take_posture

    def begin(name: str, speed: float) -> FakeMovement:
        taking.set()
        return take_posture(name, speed) if name != "Sit" else Endless(bench.fake.body)

    bench.fake.motion.take_posture = begin  # type: ignore[method-assign]
    (work,) = bench.aside
    other = threading.Thread(target=work)
    other.start()
    assert taking.wait(10)
    bench.call("rapp_take_predefined_posture", posture="Stand", speed=0.0)
    other.join(10)
    bench.fake.motion.take_posture = take_posture  # type: ignore[method-assign]
    bench.aside.clear()
    bench.executor.put_back()
    bench.go_on()
    assert (bench.fake.motion.at, bench.fake.motion.awake) == ("Sit", False)


class Endless(FakeMovement):
    """A motion that ends only when it is stopped."""

    def __init__(self, body: Any) -> None:
        super().__init__(body, math.inf, lambda: None, lambda: None)

    def wait(self, seconds: float) -> bool:
        time.sleep(0.001)  # of the test's own: the clock belongs to the other thread
        return self.done()
