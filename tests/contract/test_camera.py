"""Every driver of the port Camera takes pictures of each camera and size, and obeys its parameters."""

import pytest

from rapp_core.errors import Refused

SIZES = {0: (160, 120), 1: (320, 240), 2: (640, 480), 3: (1280, 960)}
BRIGHTNESS = 0


def brightness(picture):
    return sum(picture.data) / len(picture.data)


@pytest.mark.parametrize("resolution", SIZES)
@pytest.mark.parametrize("name", ["top", "bottom"])
def test_takes_a_picture(driver, name, resolution):
    picture = driver.robot.camera.capture(name, resolution)
    assert (picture.width, picture.height) == SIZES[resolution]
    assert len(picture.data) == 3 * picture.width * picture.height
    assert picture.camera == name


def test_a_picture_is_of_its_time(driver):
    first = driver.robot.camera.capture("top", 0)
    driver.wait(0.5)
    assert driver.robot.camera.capture("top", 0).stamp > first.stamp


def test_both_cameras_do_not_show_the_same(driver):
    top, bottom = (driver.robot.camera.capture(name, 1) for name in ("top", "bottom"))
    assert top.data != bottom.data


def test_a_parameter_changes_the_picture(driver):
    camera = driver.robot.camera
    camera.set_parameter("top", BRIGHTNESS, 20)
    driver.wait(1.0)
    dark = brightness(camera.capture("top", 1))
    camera.set_parameter("top", BRIGHTNESS, 120)
    driver.wait(1.0)
    assert brightness(camera.capture("top", 1)) > dark + 5


@pytest.mark.parametrize(("parameter", "value"), [(BRIGHTNESS, 256), (BRIGHTNESS, -1), (99, 1)])
def test_a_parameter_that_the_camera_does_not_take_is_refused(driver, parameter, value):
    with pytest.raises(Refused, match=f"parameter {parameter} of the top camera to {value}"):
        driver.robot.camera.set_parameter("top", parameter, value)


def test_sees_again_after_it_was_closed(driver):
    driver.robot.camera.capture("top", 0)
    driver.robot.camera.close()
    driver.robot.camera.close()
    assert driver.robot.camera.capture("top", 0).width == 160
