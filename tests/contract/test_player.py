"""Every driver of the port Player plays to the end, loops until stopped, and refuses what is not there."""

import pytest

from rapp_core.errors import Refused


def test_plays_to_the_end(driver, sound):
    driver.robot.player.play(sound, 0.0, 1.0, 0.0)
    driver.robot.player.play(sound, 0.05, 0.5, -1.0)


def test_a_loop_returns_at_once_and_is_stopped(driver, sound):
    driver.robot.player.loop(sound, 1.0, 0.0)
    driver.robot.player.stop()
    driver.robot.player.play(sound, 0.0, 1.0, 0.0)


def test_a_file_that_is_not_there_is_refused(driver):
    with pytest.raises(Refused):
        driver.robot.player.play(driver.folder / "none.ogg", 0.0, 1.0, 0.0)


def test_stopping_a_quiet_player_is_no_error(driver):
    driver.robot.player.stop()
    driver.robot.player.stop()
