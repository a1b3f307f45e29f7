"""Photographs of the running world."""

import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.process import WorldClient


def shot(world: WorldClient, path: Path) -> np.ndarray:
    world.photograph(path)
    image = cv2.imread(str(path))
    assert image is not None
    return np.asarray(image)


def test_a_photograph_shows_the_robot_in_its_room(world: WorldClient, tmp_path: Path) -> None:
    image = shot(world, tmp_path / "room.png")
    assert image.shape == (360, 480, 3)
    assert image.std() > 30
    blue, green, red = (image[:, :, channel].astype(int) for channel in range(3))
    assert ((red > 200) & (green > 70) & (green < 140) & (blue < 60)).sum() > 400  # the robot's orange
    assert [path.name for path in tmp_path.iterdir()] == ["room.png"]


def test_the_picture_follows_the_world(world: WorldClient, tmp_path: Path) -> None:
    world.set_door(-0.6)
    world.set_lamp(0.9)
    before = shot(world, tmp_path / "1.png").astype(int)
    world.set_door(0.0)
    shut = shot(world, tmp_path / "2.png").astype(int)
    assert (abs(shut - before).max(axis=2) > 40).sum() > 1500
    world.set_lamp(0.0)
    assert shot(world, tmp_path / "3.png").mean() < 0.7 * shut.mean()
    world.set_lamp(0.9)
    world.set_joints(["LShoulderPitch"], [-1.2], 1.0)
    time.sleep(1.0)
    assert (abs(shot(world, tmp_path / "4.png").astype(int) - shut).max(axis=2) > 40).sum() > 120


def test_a_picture_that_cannot_be_written_is_refused(world: WorldClient, tmp_path: Path) -> None:
    with pytest.raises(Refused, match="cannot write"):
        world.photograph(tmp_path / "missing" / "room.png")
