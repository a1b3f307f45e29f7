"""The services that walk: what they ask of the robot, what they refuse, and which hazards stop them."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from fakes.bench import Bench
from fakes.walking import CONFIG, HAZARDS, along, drive, near, walk
from rapp_core.errors import Invalid, Refused, Unreachable


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, **CONFIG)


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


def test_however_slow_or_short_a_walk_ahead_is_no_obstacle_is_walked_into(bench: Bench) -> None:
    bench.fake.feeling.feel(sonar=(math.inf, 0.25))
    for x, y in ((0.019, 0.0), (0.001, 0.0), (0.01, 0.06)):
        with pytest.raises(Refused, match="obstacle"):
            drive(bench, x, y)
    for begin in (lambda: walk(bench, 0.02), lambda: walk(bench, 0.001), lambda: along(bench, ("base_link", 0.01, 0.0, 0.0))):
        with pytest.raises(Refused, match="obstacle"):
            begin()
    assert bench.fake.journal == []


def test_poses_close_to_each_other_do_not_lead_into_an_obstacle(bench: Bench) -> None:
    bench.clock.at(0.3, lambda: bench.fake.feeling.feel(sonar=(0.25, math.inf)))
    with pytest.raises(Refused, match="obstacle"):
        along(bench, *[("odom", 0.02 * number, 0.0, 0.0) for number in range(1, 10)])
    assert bench.fake.motion.pose().x < 0.05


def test_a_slow_walk_is_stopped_by_an_obstacle(bench: Bench) -> None:
    drive(bench, 0.019)
    bench.clock.at(3.0, lambda: bench.fake.feeling.feel(sonar=(0.25, math.inf)))
    bench.go_on()
    assert 3.0 <= bench.clock.time <= 3.1


def test_who_sways_while_it_turns_or_steps_aside_does_not_walk_ahead(bench: Bench) -> None:
    bench.fake.feeling.feel(sonar=(0.2, 0.2))
    bench.fake.motion.at = "Crouch"
    bench.clock.at(1.0, lambda: bench.fake.motion.shift(-0.015))  # while it stands up
    walk(bench, 0.0, 0.0, 1.0)
    walk(bench, 0.0, 0.2)


def test_who_has_met_something_and_steps_aside_slowly_back_does_not_step_back(bench: Bench) -> None:
    bench.fake.feeling.feel(bumpers=(True, False))
    with pytest.raises(Refused, match="bumper"):
        drive(bench, -0.001, 0.06)


def test_who_has_met_something_may_step_back_only(bench: Bench) -> None:
    bench.fake.feeling.feel(bumpers=(True, True))
    walk(bench, -0.2)
    for way in ({"x": 0.2}, {"x": 0.0, "theta": 1.0}):
        with pytest.raises(Refused, match="bumper"):
            walk(bench, **way)


def test_a_walking_robot_is_felt_twenty_times_a_second(bench: Bench) -> None:
    walk(bench)
    assert bench.fake.feeling.asked == pytest.approx(200, rel=0.25)
