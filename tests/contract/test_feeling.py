"""Every driver of the port Feeling tells what the body feels."""

import math


def test_feels_a_robot_that_stands_in_free_space(driver):
    senses = driver.robot.feeling.senses()
    assert "HeadYaw" in senses.joints
    assert all(math.isfinite(angle) for angle in senses.joints.values())
    assert all(distance > 0 for distance in senses.sonar)
    assert senses.bumpers == (False, False)
    assert 0 < senses.battery <= 1
    assert math.hypot(senses.velocity.x, senses.velocity.y) < 0.05
    assert not senses.fallen


def test_feels_no_hand_where_there_is_none(driver):
    assert driver.robot.feeling.touched() is False


def test_feels_again_after_it_was_closed(driver):
    driver.robot.feeling.close()
    driver.robot.feeling.close()
    assert not driver.robot.feeling.senses().fallen
