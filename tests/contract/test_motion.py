"""Every driver of the port Motion walks, moves joints, takes postures, looks and rests; tells its limits; and stops at once."""

import math

import numpy as np
import pytest

from rapp_core.body_ports import Pose2D
from rapp_core.errors import CoreError, Refused
from rapp_core.geometry import relative

PATIENCE = 30.0  # s for one motion
STILL = 0.3  # s from a stop to the end of a motion of joints
STEP = 1.0  # s from a stop to the end of a walk
HEAD = ("HeadYaw", "HeadPitch")


def finish(movement):
    """The result of a motion, once it has ended."""
    for _ in range(round(PATIENCE / 0.05)):
        if movement.wait(0.05):
            return movement.result()
    raise AssertionError("the motion does not end")


def comes_to_rest(driver, motion):
    """Whether a robot that was stopped stands still soon: it has a foot in the air perhaps."""
    for _ in range(round(STEP / 0.05)):
        if not motion.moving():
            return True
        driver.wait(0.05)
    return False


@pytest.fixture
def motion(driver):
    """The body of a robot that stands."""
    motion = driver.robot.motion
    if motion.posture() != "StandInit" or not motion.standing():
        assert finish(motion.take_posture("StandInit", 1.0))
    yield motion
    motion.stop()


def test_walks_to_a_pose_in_the_frame_of_the_start(motion):
    start = motion.pose()
    assert finish(motion.move_to(0.15, 0.0, 0.3))
    way = relative(start, motion.pose())
    assert (way.x, way.y, way.theta) == pytest.approx((0.15, 0.0, 0.3), abs=0.05)
    assert motion.standing()


def test_a_walk_ends_when_all_motion_is_stopped_and_has_not_reached_its_goal(driver, motion):
    start, walk = motion.pose(), motion.move_to(2.0, 0.0, 0.0)
    driver.wait(1.0)
    assert motion.moving()
    motion.stop()
    assert walk.wait(2.0)
    assert not walk.result()
    assert comes_to_rest(driver, motion)
    assert relative(start, motion.pose()).x < 1.0


def test_a_walk_can_be_cancelled_by_itself(driver, motion):
    walk = motion.move_to(2.0, 0.0, 0.0)
    driver.wait(0.5)
    walk.cancel()
    assert walk.wait(2.0)
    assert not walk.result()
    walk.cancel()


def test_a_velocity_holds_until_it_is_stopped(driver, motion):
    start, walk = motion.pose(), motion.move_velocity(0.08, 0.0, 0.0)
    driver.wait(2.5)
    assert motion.moving()
    assert not walk.done()
    walk.cancel()
    assert comes_to_rest(driver, motion)
    assert walk.done()
    assert not walk.result()
    assert relative(start, motion.pose()).x > 0.03


def test_joints_move_to_angles(motion):
    goal = {"HeadYaw": 0.4, "HeadPitch": -0.2}
    assert finish(motion.move_joints(goal, 0.5))
    assert motion.angles(HEAD) == pytest.approx(tuple(goal.values()), abs=0.03)
    assert finish(motion.move_joints(dict.fromkeys(HEAD, 0.0), 1.0))


def test_joints_stop_on_their_way_and_a_walk_goes_on(driver, motion):
    head, walk = motion.move_joints({"HeadYaw": 1.0}, 0.05), motion.move_to(1.0, 0.0, 0.0)
    driver.wait(0.5)
    head.cancel()
    assert head.wait(STILL)
    assert not head.result()
    assert not walk.done()
    motion.stop()
    assert walk.wait(2.0)
    assert motion.angles(("HeadYaw",))[0] < 0.9


def test_a_posture_is_taken_and_can_be_stopped(driver, motion):
    taking = motion.take_posture("Crouch", 0.2)
    driver.wait(0.3)
    motion.stop()
    assert taking.wait(STILL)
    assert not taking.result()
    assert finish(motion.take_posture("Crouch", 1.0))
    assert motion.posture() == "Crouch"


def test_looks_at_a_point_with_the_top_camera(motion):
    assert finish(motion.look_at(1.0, 0.5, 0.4, 0.5))
    if len(motion.limits()) > 10:  # of the fake's head nothing more is known
        camera = np.array(motion.transform("CameraTop", 2)).reshape(4, 4)
        ahead, left, above, _ = np.linalg.inv(camera) @ (1.0, 0.5, 0.4, 1.0)
        assert math.hypot(left, above) / ahead < 0.02
    assert motion.angles(("HeadYaw",))[0] == pytest.approx(math.atan2(0.5, 1.0), abs=0.05)


def test_a_point_behind_is_refused(motion):
    with pytest.raises(Refused, match="neck"):
        motion.look_at(-2.0, 0.0, 0.4, 0.5)


def test_rests_without_motors_and_stands_up_again(driver, motion):
    assert finish(motion.release())
    assert not motion.standing()
    assert finish(motion.take_posture("StandInit", 1.0))
    assert motion.standing()
    assert finish(motion.relax())
    assert not motion.standing()


def test_a_robot_without_motors_is_known_to_sit(driver, motion):
    assert finish(motion.take_posture("Sit", 1.0))
    assert motion.nearest_posture() == "Sit"
    assert finish(motion.relax())
    driver.wait(0.5)
    assert motion.nearest_posture() == "Sit"


def test_names_its_postures_joints_and_their_limits(motion):
    assert {"StandInit", "Crouch", "Sit"} <= set(motion.postures())
    limits = motion.limits()
    assert (limits["HeadYaw"].lower, limits["HeadYaw"].upper) == pytest.approx((-2.0857, 2.0857), abs=1e-3)
    assert limits["HeadYaw"].speed > 1


def test_the_matrix_of_a_part_ends_with_its_last_row(motion):
    for space in (0, 1, 2):
        assert motion.transform("CameraTop", space)[12:] == pytest.approx((0.0, 0.0, 0.0, 1.0))
    with pytest.raises(CoreError, match="'Tail'"):
        motion.transform("Tail", 0)


def test_stopping_a_still_body_is_no_error(driver):
    driver.robot.motion.stop()
    driver.robot.motion.stop()


def test_a_pose_is_one_on_the_ground(driver):
    assert isinstance(driver.robot.motion.pose(), Pose2D)
    assert driver.robot.present()
