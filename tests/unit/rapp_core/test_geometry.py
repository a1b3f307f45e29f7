"""Poses on the ground, the place in the map, where the head looks, and poses as ROS messages."""

import math

import geometry_msgs.msg
import numpy as np
import pytest

from rapp_core.body_ports import Picture, Pose2D
from rapp_core.geometry import compose, inverse, relative, turned
from rapp_core.robot.naoqi.gaze import CAMERA_ABOVE, CAMERA_AHEAD, CAMERA_DOWN, NECK, gaze
from rapp_core.ros.conversions import image, on_ground, pose, stamped
from rapp_core.services.place import Place, Waypoint

POSES = [Pose2D(0.0, 0.0, 0.0), Pose2D(1.0, -2.0, 0.5), Pose2D(-3.0, 0.1, 3.0), Pose2D(0.2, 0.3, -3.1)]


def same(a: Pose2D, b: Pose2D) -> bool:
    return (a.x, a.y, turned(a.theta - b.theta)) == pytest.approx((b.x, b.y, 0.0), abs=1e-9)


@pytest.mark.parametrize("frame", POSES)
@pytest.mark.parametrize("place", POSES)
def test_there_and_back(frame: Pose2D, place: Pose2D) -> None:
    assert same(relative(frame, compose(frame, place)), place)
    assert same(compose(inverse(frame), frame), POSES[0])


def test_a_quarter_turn_makes_ahead_the_left() -> None:
    assert same(compose(Pose2D(1.0, 1.0, math.pi / 2), Pose2D(2.0, 0.0, 0.0)), Pose2D(1.0, 3.0, math.pi / 2))


@pytest.mark.parametrize("odom", POSES)
@pytest.mark.parametrize("told", POSES)
def test_what_was_told_is_where_the_robot_is_in_the_map(odom: Pose2D, told: Pose2D) -> None:
    place = Place()
    place.tell(told, odom)
    assert same(place.in_map(odom), told)
    assert same(place.in_odom(Waypoint("map", told), POSES[0]), odom)
    assert same(place.in_odom(Waypoint("base_link", POSES[0]), odom), odom)
    assert same(place.in_odom(Waypoint("odom", odom), told), odom)


@pytest.mark.parametrize("place", POSES)
def test_poses_pass_ros(place: Pose2D) -> None:
    assert same(on_ground(pose(place)), place)


def test_a_quaternion_need_not_be_of_length_one_and_may_lean() -> None:
    message = geometry_msgs.msg.Pose()
    message.orientation.w = message.orientation.z = 3.0
    assert on_ground(message).theta == pytest.approx(math.pi / 2)
    leaning = geometry_msgs.msg.Quaternion(x=math.sin(0.2), w=math.cos(0.2))
    assert on_ground(geometry_msgs.msg.Pose(orientation=leaning)).theta == pytest.approx(0.0)


def test_a_quaternion_that_is_none_is_no_direction() -> None:
    assert math.isnan(on_ground(geometry_msgs.msg.Pose()).theta)


def test_a_picture_as_ros_message() -> None:
    message = image(Picture(2, 1, b"abcdef", 12.5, "bottom"))
    assert (message.width, message.height, message.step, message.encoding, message.data) == (2, 1, 6, "bgr8", b"abcdef")
    assert (message.header.stamp.to_sec(), message.header.frame_id) == (12.5, "camera_bottom_optical_frame")


def test_a_pose_in_map_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rospy.Time.now", lambda: 0)
    assert stamped(Pose2D(1.0, 2.0, 0.0)).header.frame_id == "map"


def rotation(axis: str, angle: float) -> np.ndarray:
    cos, sin = math.cos(angle), math.sin(angle)
    matrix = np.eye(4)
    if axis == "y":
        matrix[0, 0] = matrix[2, 2] = cos
        matrix[0, 2], matrix[2, 0] = sin, -sin
    else:
        matrix[:2, :2] = [[cos, -sin], [sin, cos]]
    return matrix


def shift(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


@pytest.mark.parametrize("point", [(2.0, 0.0, 0.5), (1.0, 1.0, 0.1), (0.5, -0.8, 0.9), (3.0, 2.0, 1.5), (0.3, 0.0, 0.4)])
@pytest.mark.parametrize("lean", [0.0, 0.1])
def test_the_point_lies_on_the_camera_s_axis(point: tuple[float, float, float], lean: float) -> None:
    torso = shift(0.01, 0.02, 0.33) @ rotation("y", lean)
    found = gaze(torso.flatten(), *point)
    assert found is not None
    yaw, pitch = found
    head = torso @ shift(0.0, 0.0, NECK) @ rotation("z", yaw) @ rotation("y", pitch)
    camera = head @ shift(CAMERA_AHEAD, 0.0, CAMERA_ABOVE) @ rotation("y", CAMERA_DOWN)
    seen = np.linalg.inv(camera) @ np.array([*point, 1.0])
    assert seen[0] > 0
    assert seen[1:3] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_nothing_looks_into_its_own_head() -> None:
    assert gaze(shift(0.0, 0.0, 0.3).flatten(), 0.0, 0.0, 0.3 + NECK + 0.05) is None
