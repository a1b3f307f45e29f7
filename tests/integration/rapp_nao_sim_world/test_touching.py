"""The room knows what the robot has touched."""

import math
import time
from collections.abc import Callable, Iterator

import pytest

from rapp_nao_sim.world.process import WorldClient

AHEAD = 0.40  # m from the middle of the feet to the carton's: a quarter of a metre to its side
PATIENCE = 20.0  # s
WAY = (0.3, 0.0, 0.0)


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.fixture
def carton(world: WorldClient) -> Iterator[str]:
    x, y, turn = world.robot_pose()
    world.place_object("carton", (x + AHEAD * math.cos(turn), y + AHEAD * math.sin(turn), 0.175, turn))
    yield "carton"
    world.remove_object("carton")


def test_what_the_robot_walks_against_is_told_and_the_floor_is_not(world: WorldClient, carton: str) -> None:
    world.take_touched()
    assert not world.walk_to([WAY], 1.0, 0.02)
    assert world.take_touched() == [carton]
    world.remove_object(carton)
    world.wait_for_walk(PATIENCE)
    until(lambda: not world.feelings().pressed)
    world.take_touched()
    assert world.walk_to([(-0.1, 0.0, 0.0)], 1.0, 0.02)
    assert world.take_touched() == []
