"""The angle of doors drawn by a pinhole of the tests' own, in other rooms than the simulator's."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from fakes.drawn_room import DoorScene, draw_codes, draw_door
from rapp_cloud.vision.door import look_at_door

SCENES = {
    "plain": DoorScene(),
    "hinge on the right": DoorScene(hinge_left=False, aside=0.6, turn=-12),
    "into the next room": DoorScene(inwards=False, aside=0.9, turn=-4),
    "pale and noisy, looking up": DoorScene(eye=0.5, away=3.2, up=10, leaf=(200, 220, 230), noise=3),
    "dark and noisy": DoorScene(leaf=(70, 70, 60), wall=(120, 170, 120), bright=0.5, noise=4),
}
# Looked at only after everything had been chosen.
OTHERS = {
    "blue": DoorScene(leaf=(150, 90, 60), wall=(210, 200, 190), floor=(70, 70, 80), aside=-0.9, turn=18, away=3.3, noise=2),
    "on the right, far": DoorScene(hinge_left=False, aside=0.9, turn=-16, away=3.6, eye=0.6, up=6, noise=2),
    "large picture": DoorScene(size=(960, 720), aside=-0.4, turn=9, eye=0.7, up=5),
}
BESIDE = 3.0  # degrees


@pytest.mark.parametrize("name", [*SCENES, *OTHERS])
def test_doors_from_closed_to_wide_open(name: str) -> None:
    scene = (SCENES | OTHERS)[name]
    doors = {angle: look_at_door(draw_door(replace(scene, angle=angle))) for angle in range(0, 91, 10)}
    wrong = {
        angle: (math.degrees(door.angle), door.confidence)
        for angle, door in doors.items()
        if door.sure and door.angle is not None and abs(math.degrees(door.angle) - angle) > BESIDE
    }
    assert not wrong
    assert sum(door.sure for door in doors.values()) >= 9


def test_a_doorway_without_a_leaf_is_not_taken_for_a_closed_door() -> None:
    """Opened into the next room as seen along the leaf, which is then a line."""
    scene = DoorScene(inwards=False, aside=0.0, turn=4, angle=90)
    assert not look_at_door(draw_door(scene)).sure


@pytest.mark.parametrize("kind", ["grey", "noise", "codes", "stripes"])
def test_what_is_no_door_is_not_taken_for_one(kind: str) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (480, 640, 3), np.uint8)
    stripes = np.zeros((480, 640, 3), np.uint8)
    stripes[:, ::40] = 255
    pictures = {
        "grey": np.full((480, 640, 3), 120, np.uint8),
        "noise": noise,
        "codes": draw_codes(("a", 200, 200, 150), ("b", 450, 250, 200)),
        "stripes": stripes,
    }
    assert not look_at_door(pictures[kind]).sure


@pytest.mark.parametrize("side", [1, 8, 40])
def test_tiny_pictures_are_not_sure(side: int) -> None:
    assert not look_at_door(np.full((side, side, 3), 90, np.uint8)).sure


def test_another_field_of_view_is_taken_into_account() -> None:
    """Half of a picture, enlarged, is a picture of a longer lens."""
    picture = draw_door(DoorScene(angle=30, turn=8, up=2, size=(960, 720)))
    middle = np.ascontiguousarray(picture[60:660, 80:880])
    shorter = 2 * math.atan(math.tan(math.radians(60.97) / 2) * 800 / 960)
    enlarged = np.asarray(cv2.resize(middle, (640, 480), interpolation=cv2.INTER_AREA), np.uint8)
    door = look_at_door(enlarged, shorter)
    assert door.sure and door.angle is not None
    assert math.degrees(door.angle) == pytest.approx(30, abs=BESIDE)
