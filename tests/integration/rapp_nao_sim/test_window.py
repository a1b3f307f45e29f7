"""The simulator's window, on a real X server: it shows the room as it changes, and the robot does without it."""

import time

import cv2
import pytest

from fakes.screen import Screen, a_screen

PATIENCE = 60.0  # s; without a graphics card every picture is computed


@pytest.fixture(name="screen")
def _screen(tmp_path, monkeypatch):
    with a_screen(tmp_path) as screen:
        monkeypatch.setenv("DISPLAY", screen.name)
        yield screen


@pytest.fixture(name="shown")
def _shown(simulate, screen, wait_for):
    """A simulator whose room is on the screen."""
    assert screen.look().max() == 0
    sim = simulate("--gui", "--microphone", "text", "--voice", "silent")
    wait_for(lambda: screen.look().std() > 20, PATIENCE)
    return sim


def _settled(screen: Screen) -> bool:
    before = screen.look()
    time.sleep(0.5)
    return _changed(before, screen) == 0


def _changed(before, screen: Screen) -> int:
    """How many values of the picture are others than before."""
    return int((cv2.absdiff(screen.look(), before) > 20).sum())


def test_the_window_shows_the_room_and_what_changes_in_it(shown, screen, wait_for, children, gone):
    world = shown.service("SimWorld")
    changes = (
        (lambda: world.setDoor(0.0 if abs(world.getDoor()) > 0.5 else 1.4), 3000),
        (lambda: world.setLamp(0.0 if world.getLamp() > 0.5 else 1.0), 300),
        (lambda: shown.service("ALRobotPosture").goToPosture("Crouch", 1.0), 1000),
    )
    for change, least in changes:
        wait_for(lambda: _settled(screen), PATIENCE)
        before = screen.look()
        change()
        wait_for(lambda before=before, least=least: _changed(before, screen) > least, PATIENCE)
    started = children(shown.process.pid)
    assert shown.end() == 0
    assert all(gone(pid) for pid in started)


def test_the_robot_goes_on_without_its_screen(shown, screen, wait_for):
    screen.process.kill()
    wait_for(lambda: "the window is closed; the simulator goes on" in shown.log.read_text(), PATIENCE)
    shown.service("ALMotion").wakeUp()
    assert shown.service("ALMotion").robotIsWakeUp()
    assert shown.end() == 0
