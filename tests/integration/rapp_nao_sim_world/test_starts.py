"""Other places of the room from which the robot may start."""

import pytest

from rapp_nao_sim.world import room
from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.process import WorldClient


def test_the_robot_starts_at_each_place_of_the_room(world: WorldClient) -> None:
    starts = room.load().starts
    assert len(starts) >= 3
    for place in starts:
        world.start_at(place.name)
        assert world.robot_pose() == pytest.approx((place.x, place.y, place.theta), abs=0.02)


def test_an_unknown_place_is_refused_by_name(world: WorldClient) -> None:
    before = world.robot_pose()
    with pytest.raises(Refused, match="places are window, table, chair"):
        world.start_at("cellar")
    assert world.robot_pose() == pytest.approx(before, abs=0.01)
