"""Lamps drawn before walls: against what is round them, never by their own brightness."""

import numpy as np
import pytest

from fakes.drawn_room import Colour, draw_lamp
from rapp_cloud.vision.light import ON, look_at_lamp

WALL = (150, 140, 130)
WARM = (200, 235, 250)


@pytest.mark.parametrize("bright", [0.3, 0.6, 1.0])
@pytest.mark.parametrize(("shade", "on"), [(WARM, True), ((60, 70, 75), False)])
def test_a_lamp_is_judged_by_its_surroundings_whatever_the_exposure(bright: float, shade: Colour, on: bool) -> None:
    light = look_at_lamp((draw_lamp(shade, WALL) * bright).astype(np.uint8))
    assert light.sure and light.level is not None
    assert (light.level >= ON) == on


@pytest.mark.parametrize("noise", [2, 6])
@pytest.mark.parametrize(("radius", "middle"), [(0.03, (0.5, 0.5)), (0.15, (0.53, 0.46)), (0.22, (0.5, 0.55))])
def test_lamps_of_all_sizes_with_noise(noise: float, radius: float, middle: tuple[float, float]) -> None:
    random = np.random.default_rng(2)
    for shade, on in ((WARM, True), ((60, 70, 75), False)):
        picture = draw_lamp(shade, WALL, radius, middle) + random.normal(0, noise, (480, 640, 3))
        light = look_at_lamp(np.clip(picture, 0, 255).astype(np.uint8))
        assert light.sure and light.level is not None
        assert (light.level >= ON) == on


def test_a_lamp_like_the_wall_may_be_either() -> None:
    assert not look_at_lamp(draw_lamp((152, 142, 133), WALL)).sure
    assert not look_at_lamp(draw_lamp((150, 140, 140), WALL)).sure


def test_brighter_lamps_have_higher_levels() -> None:
    levels = [look_at_lamp(draw_lamp((shade,) * 3, (140, 140, 140))).level for shade in (60, 115, 165, 220)]
    assert levels == [0, 0, 100, 100]


def test_without_a_lamp_in_the_middle_nothing_is_said() -> None:
    assert look_at_lamp(np.full((480, 640, 3), 128, np.uint8)).level is None
    assert look_at_lamp(draw_lamp(WARM, WALL, middle=(0.15, 0.3))).level is None
    assert look_at_lamp(draw_lamp(WARM, WALL, radius=0.6)).level is None
    assert not look_at_lamp(np.random.default_rng(1).integers(0, 255, (480, 640, 3), np.uint8)).sure


@pytest.mark.parametrize("side", [1, 8, 40])
def test_tiny_pictures_are_not_sure(side: int) -> None:
    assert not look_at_lamp(np.full((side, side, 3), 90, np.uint8)).sure
