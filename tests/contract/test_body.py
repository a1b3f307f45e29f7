"""Every driver of the port Body stops and rests, moving or not; and tells whether the robot is there."""


def test_stopping_a_still_body_is_no_error(driver):
    driver.robot.body.stop()
    driver.robot.body.stop()


def test_releases(driver):
    driver.robot.body.release()
    driver.robot.body.stop()


def test_is_present(driver):
    assert driver.robot.present()
