"""Every driver of the port Motion stops and rests, moving or not; and tells whether the robot is there."""


def test_stopping_a_still_body_is_no_error(driver):
    driver.robot.motion.stop()
    driver.robot.motion.stop()


def test_releases(driver):
    driver.robot.motion.release()
    driver.robot.motion.stop()


def test_is_present(driver):
    assert driver.robot.present()
