"""A robot that a run has moved is brought back to how it was found."""

import math
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from fakes.bench import Bench
from fakes.robot_body import FakeMovement
from fakes.walking import CONFIG


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, **CONFIG)


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


def fail(bench: Bench, posture: str) -> None:
    """The robot ends the way to a posture by itself."""
    take_posture = bench.fake.motion.take_posture

    def begin(name: str, speed: float) -> FakeMovement:
        movement = take_posture(name, speed)
        if name == posture:
            movement.halt()
        return movement

    bench.fake.motion.take_posture = begin  # type: ignore[method-assign]


def test_a_robot_that_does_not_come_back_to_its_posture_rests_where_it_is(bench: Bench) -> None:
    fail(bench, "Sit")
    assert leave(bench, "Sit") == ["posture Sit at 0.6", "rest"]
    assert not bench.fake.motion.awake
    assert bench.context.calls.take_before() is None


def test_a_robot_that_does_not_even_rest_is_told_of_and_put_back_another_time(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    bench.fake.motion.release = lambda: Ended(bench.fake.body)  # type: ignore[method-assign]
    leave(bench, "Stand")
    assert "not back at rest: cannot finish: the robot has ended rest by itself" in caplog.text
    assert bench.context.calls.take_before() == "Stand"


def test_a_robot_that_is_away_is_put_back_another_time(bench: Bench) -> None:
    bench.fake.motion.at = "Sit"
    bench.call("rapp_take_predefined_posture", posture="StandInit", speed=0.0)
    for here in (False, True):
        bench.fake.body.here = here
        bench.executor.put_back()
        bench.go_on()
    assert (bench.fake.motion.at, bench.fake.motion.awake) == ("Sit", False)


def test_a_way_back_that_a_person_stops_is_not_followed_by_a_rest(bench: Bench) -> None:
    bench.clock.at(3.0, lambda: bench.call("rapp_move_stop"))  # a posture takes 2 s
    assert leave(bench, "Sit") == ["posture Sit at 0.6", "stop motion"]


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


class Ended(FakeMovement):
    """A motion that the robot has ended by itself."""

    def __init__(self, body: Any) -> None:
        super().__init__(body, math.inf, lambda: None, lambda: None)
        self.halt()
