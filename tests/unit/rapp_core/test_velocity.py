"""A walk with a velocity on NAOqi, which tells only when it is asked whether it goes on."""

import threading
import time

import pytest
import qi

from rapp_core.robot.naoqi.movement import Walking
from rapp_core.services.context import STEP


class Walker:
    """A robot that walks until it is told to stop; `asked` counts how often it was asked whether it does."""

    def __init__(self) -> None:
        begun = qi.Promise()
        begun.setValue(None)
        self.asked, self.walks = 0, True
        self.walking = Walking(self._active, begun.future(), self._halt, lambda _future: None)

    def _active(self) -> bool:
        self.asked += 1
        return self.walks

    def _halt(self) -> None:
        self.walks = False


def wait_for_a_second(walker: Walker) -> None:
    """As a service does: again and again, for a step each."""
    until = time.monotonic() + 1.0
    while time.monotonic() < until:
        assert not walker.walking.wait(STEP)


@pytest.fixture
def walker() -> Walker:
    return Walker()


def test_a_robot_that_walks_is_asked_only_now_and_then(walker: Walker) -> None:
    wait_for_a_second(walker)
    assert walker.asked < 100


def test_who_waits_for_its_end_is_told_when_it_is_stopped(walker: Walker) -> None:
    ended = threading.Event()
    threading.Thread(target=lambda: walker.walking.wait(60.0) and ended.set(), daemon=True).start()
    walker.walking.cancel()
    assert ended.wait(10)
    assert walker.walking.wait(60.0)
    assert walker.asked < 100


def test_a_robot_that_takes_its_time_to_stop_is_asked_now_and_then_too(walker: Walker) -> None:
    walker.walking.cancel()
    walker.walks = True
    wait_for_a_second(walker)
    assert walker.asked < 100
