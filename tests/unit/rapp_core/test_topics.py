"""Topics of the body and the cameras: what is measured when, and the messages made of it."""

import math
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import pytest
import rospy

from rapp_core.body_ports import Picture, Pose2D, Senses
from rapp_core.errors import Unreachable
from rapp_core.ros.topics import body, camera, diagnostics
from rapp_core.ros.topics.offer import unless
from rapp_core.ros.topics.streams import AGAIN, IDLE, Stream, Topic

STAMP = rospy.Time(100, 5)
TURNED = (0.0, -1.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.2, 0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0)  # a quarter to the left
FELT = body.Felt(
    Senses({"HeadYaw": 0.5, "HeadPitch": -0.1}, (0.4, math.inf), (False, True), 0.75, Pose2D(0.05, 0.0, 0.1), fallen=False),
    Pose2D(1.0, 2.0, math.pi / 2),
    Pose2D(0.0, 0.0, 0.0),
    {"torso": TURNED, "camera_top_optical_frame": TURNED},
    STAMP,
)
PICTURE = Picture(4, 2, bytes(range(24)), 100.5)


class Listeners:
    """A publisher with a number of subscribers."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.published: list[Any] = []

    def get_num_connections(self) -> int:
        return self.number

    def publish(self, message: Any) -> None:
        self.published.append(message)


def stream(measure: Any, *topics: Topic, idle: Callable[[], None] = lambda: None) -> Stream:
    """A stream that is stepped by hand."""
    return Stream("probe", 0.04, measure, topics, idle)


def test_nothing_is_measured_without_subscribers() -> None:
    asked: list[int] = []
    assert stream(lambda: asked.append(1), Topic(Listeners(0), str)).step() == IDLE
    assert not asked


def test_one_measurement_feeds_all_topics_that_are_wanted() -> None:
    asked: list[int] = []

    def measure() -> int:
        asked.append(1)
        return 7

    first, second, alone = Listeners(1), Listeners(2), Listeners(0)
    assert stream(measure, Topic(first, str), Topic(second, float), Topic(alone, str)).step() == 0.04
    assert (first.published, second.published, alone.published) == (["7"], [7.0], [])
    assert len(asked) == 1


def test_a_robot_that_is_away_is_asked_again_later() -> None:
    def measure() -> int:
        raise Unreachable("cannot reach it")

    listener = Listeners(1)
    assert stream(measure, Topic(listener, str)).step() == AGAIN
    assert not listener.published


def test_an_odd_answer_is_logged_once_and_does_not_end_the_topics(caplog: pytest.LogCaptureFixture) -> None:
    answers: list[Any] = ["?", "?", 1, "x", 2]
    number, text = Listeners(1), Listeners(1)
    probe = stream(lambda: answers.pop(0), Topic(number, int), Topic(text, str))
    assert [probe.step() for _ in range(5)] == [0.04] * 5
    assert probe.step() == 0.04  # nothing is left to measure
    assert (number.published, text.published) == ([1, 2], ["?", "?", "1", "x", "2"])
    assert [type(record.exc_info[1]) for record in caplog.records if record.exc_info] == [ValueError, IndexError]


def test_when_the_last_subscriber_has_gone_the_sense_is_idle_and_once() -> None:
    idle: list[str] = []
    first, second = Listeners(0), Listeners(0)
    probe = stream(lambda: 7, Topic(first, str), Topic(second, str), idle=lambda: idle.append("idle"))
    for numbers, calls in (((0, 0), 0), ((1, 1), 0), ((0, 1), 0), ((0, 0), 1), ((0, 0), 1), ((1, 0), 1), ((0, 0), 2)):
        first.number, second.number = numbers
        probe.step()
        assert len(idle) == calls


def test_the_senses_stay_awake_for_a_rapp() -> None:
    closed: list[str] = []
    for held in (True, False):
        unless(lambda held=held: held, lambda: closed.append("closed"))()  # type: ignore[misc]
        assert closed == ([] if held else ["closed"])


def test_joint_states_name_each_angle() -> None:
    message = body.joint_state(FELT)
    assert dict(zip(message.name, message.position, strict=True)) == {"HeadYaw": 0.5, "HeadPitch": -0.1}
    assert message.header.stamp == STAMP


def test_odometry_has_the_pose_in_odom_and_the_velocity_in_base_link() -> None:
    message = body.odometry(FELT)
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")
    assert (message.pose.pose.position.x, message.pose.pose.position.y) == (1.0, 2.0)
    assert message.pose.pose.orientation.z == pytest.approx(math.sin(math.pi / 4))
    assert (message.twist.twist.linear.x, message.twist.twist.angular.z) == (0.05, 0.1)


def test_sonar_and_bumpers_tell_left_from_right() -> None:
    assert (body.sonar("left", FELT).range, body.sonar("right", FELT).range) == (0.4, math.inf)
    assert (body.bumper("left", FELT).data, body.bumper("right", FELT).data) == (False, True)


def test_tf_forms_one_tree_with_right_rotations() -> None:
    found = {t.child_frame_id: t for t in body.transforms(FELT).transforms}
    parents = {child: t.header.frame_id for child, t in found.items()}
    assert parents == {
        "odom": "map", "base_link": "odom", "torso": "base_link", "camera_top_optical_frame": "base_link",
        "sonar_left": "torso", "sonar_right": "torso",
    }  # fmt: skip
    torso = found["torso"].transform
    assert (torso.translation.x, torso.translation.y, torso.translation.z) == (0.1, 0.2, 0.3)
    assert (torso.rotation.z, torso.rotation.w) == (pytest.approx(math.sqrt(0.5)), pytest.approx(math.sqrt(0.5)))
    ahead = rotated(found["camera_top_optical_frame"].transform.rotation, (0.0, 0.0, 1.0))
    assert ahead == pytest.approx((0.0, 1.0, 0.0))  # the camera looks where the head looks: to the left
    right = rotated(found["camera_top_optical_frame"].transform.rotation, (1.0, 0.0, 0.0))
    assert right == pytest.approx((1.0, 0.0, 0.0))


def rotated(q: Any, vector: tuple[float, float, float]) -> tuple[float, ...]:
    axis = np.array([q.x, q.y, q.z])
    v = np.array(vector)
    return tuple(v + 2 * np.cross(axis, np.cross(axis, v) + q.w * v))


@pytest.mark.parametrize("angle", [0.3, 1.5, 3.0, -2.0])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.6, 0.8, 0.0)])
def test_a_matrix_becomes_its_quaternion(angle: float, axis: tuple[float, float, float]) -> None:
    rotation, _ = cv2.Rodrigues(np.array(axis) * angle)
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    q = body.quaternion(matrix.ravel().tolist())
    assert rotated(q, (0.1, 0.2, 0.3)) == pytest.approx(tuple(rotation @ np.array([0.1, 0.2, 0.3])))


def test_pictures_become_images_and_jpegs() -> None:
    message = camera.image(PICTURE, "camera_top_optical_frame")
    assert (message.width, message.height, message.step, message.encoding) == (4, 2, 12, "bgr8")
    assert message.data == PICTURE.data
    assert message.header.stamp.to_sec() == 100.5
    grey = Picture(16, 16, bytes([128]) * 768, 1.0)
    decoded = cv2.imdecode(np.frombuffer(camera.compressed(grey, "x").data, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    assert decoded.shape == (16, 16, 3)
    assert abs(int(decoded[8, 8, 0]) - 128) < 4


def test_camera_info_sees_the_edge_of_the_field_of_view_at_the_edge_of_the_picture() -> None:
    info = camera.camera_info(Picture(640, 480, b"", 1.0), "x")
    edge = info.K[0] * math.tan(camera.FIELD_OF_VIEW[0] / 2) + info.K[2]
    assert edge == pytest.approx(639.5)


@pytest.mark.parametrize(
    ("health", "levels"),
    [
        (diagnostics.Health("s3", True, 0.9, False, True), [0, 0, 0]),
        (diagnostics.Health("s3", True, 0.1, False, False), [0, 1, 1]),
        (diagnostics.Health("s9", True, 0.9, True, True), [0, 2, 0]),
        (diagnostics.Health("s1", False, None, None, True), [0, 2, 0]),
    ],
)
def test_diagnostics_tell_what_is_wrong(health: diagnostics.Health, levels: list[int]) -> None:
    message = diagnostics.array(health, STAMP)
    assert [status.name for status in message.status] == ["rapp: core agent", "rapp: robot", "rapp: link"]
    assert [status.level for status in message.status] == levels
