"""joint_states, odom, sonar, bumper and /tf from what the body feels (sensor_msgs, nav_msgs; REP 103, 105)."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import rospy
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState, Range
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from rapp_core.body_ports import Feeling, Motion, Pose2D, Senses
from rapp_core.ros.topics.streams import Stream, Topic

SONAR_NEAR, SONAR_FAR = 0.2, 2.55  # m, what NAO's sonar tells apart
SONAR_CONE = math.radians(60.0)
SIDES = ("left", "right")
SONAR = (0.0056, 0.0192, 0.0624, 0.392)  # x, y, z (m) and yaw (rad) of the left one in the torso
CAMERAS = {"CameraTop": "camera_top_optical_frame", "CameraBottom": "camera_bottom_optical_frame"}
OPTICAL = (0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0)  # from z ahead, x right (REP 103, optical) to x ahead, z up
ROBOT = 2  # the space of Motion.transform that is base_link


@dataclass(frozen=True)
class Felt:
    """One measurement: the body's senses, its pose in odom, where odom lies in map, its frames in base_link."""

    senses: Senses
    pose: Pose2D
    odom: Pose2D
    frames: dict[str, tuple[float, ...]]  # homogeneous matrices, 16 numbers row by row
    stamp: Any  # rospy.Time


def body_stream(
    motion: Motion, feeling: Feeling, odom_in_map: Callable[[], Pose2D], period: float, idle: Callable[[], None]
) -> Stream:
    """Topics in the robot's namespace, and /tf; `period` in s."""

    def measure() -> Felt:
        frames = {frame: motion.transform(name, ROBOT) for name, frame in {"Torso": "torso", **CAMERAS}.items()}
        return Felt(feeling.senses(), motion.pose(), odom_in_map(), frames, rospy.Time.now())

    def topic(name: str, cls: Any, message: Callable[[Felt], Any]) -> Topic:
        return Topic(rospy.Publisher(name, cls, queue_size=5, tcp_nodelay=True), message)

    topics = [
        topic("joint_states", JointState, joint_state),
        topic("odom", Odometry, odometry),
        topic("/tf", TFMessage, transforms),
    ]
    for side in SIDES:
        topics.append(topic(f"sonar/{side}", Range, partial(sonar, side)))
        topics.append(topic(f"bumper/{side}", Bool, partial(bumper, side)))
    return Stream("body", period, measure, topics, idle)


def joint_state(felt: Felt) -> JointState:
    """Angles of all joints, rad."""
    message = JointState(name=list(felt.senses.joints), position=list(felt.senses.joints.values()))
    message.header.stamp = felt.stamp
    return message


def odometry(felt: Felt) -> Odometry:
    """Pose in odom, velocity in base_link."""
    message = Odometry(child_frame_id="base_link")
    message.header.stamp, message.header.frame_id = felt.stamp, "odom"
    message.pose.pose.position.x, message.pose.pose.position.y = felt.pose.x, felt.pose.y
    message.pose.pose.orientation = about_z(felt.pose.theta)
    speed = felt.senses.velocity
    message.twist.twist.linear.x, message.twist.twist.linear.y, message.twist.twist.angular.z = speed.x, speed.y, speed.theta
    return message


def sonar(side: str, felt: Felt) -> Range:
    """Distance in m; inf when nothing is in reach (REP 117)."""
    message = Range(
        radiation_type=Range.ULTRASOUND,
        field_of_view=SONAR_CONE,
        min_range=SONAR_NEAR,
        max_range=SONAR_FAR,
        range=felt.senses.sonar[SIDES.index(side)],
    )
    message.header.stamp, message.header.frame_id = felt.stamp, f"sonar_{side}"
    return message


def bumper(side: str, felt: Felt) -> Bool:
    """Whether a foot's bumper is pressed."""
    return Bool(felt.senses.bumpers[SIDES.index(side)])


def transforms(felt: Felt) -> TFMessage:
    """map to odom, odom to base_link, base_link to torso and to the cameras' optical frames."""
    found = [stamped(felt, "map", "odom", flat(felt.odom)), stamped(felt, "odom", "base_link", flat(felt.pose))]
    for frame, matrix in felt.frames.items():
        turned = matrix if frame == "torso" else _optical(matrix)
        found.append(stamped(felt, "base_link", frame, Transform(Vector3(*turned[3:12:4]), quaternion(turned))))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        x, y, z, yaw = SONAR
        found.append(stamped(felt, "torso", f"sonar_{side}", Transform(Vector3(x, sign * y, z), about_z(sign * yaw))))
    return TFMessage(found)


def stamped(felt: Felt, parent: str, child: str, transform: Transform) -> TransformStamped:
    """One transform of /tf."""
    message = TransformStamped(child_frame_id=child, transform=transform)
    message.header.stamp, message.header.frame_id = felt.stamp, parent
    return message


def flat(pose: Pose2D) -> Transform:
    """A pose on the ground as a transform."""
    return Transform(Vector3(pose.x, pose.y, 0.0), about_z(pose.theta))


def about_z(theta: float) -> Quaternion:
    """A turn about z, rad."""
    return Quaternion(0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2))


def quaternion(matrix: Sequence[float]) -> Quaternion:
    """The rotation of a homogeneous matrix of 16 numbers, row by row (Shepperd's method)."""
    m00, m01, m02, _, m10, m11, m12, _, m20, m21, m22, *_ = matrix
    squares = [1 + m00 - m11 - m22, 1 - m00 + m11 - m22, 1 - m00 - m11 + m22, 1 + m00 + m11 + m22]
    largest = max(range(4), key=squares.__getitem__)
    off = {
        0: (squares[0], m01 + m10, m02 + m20, m21 - m12),
        1: (m01 + m10, squares[1], m12 + m21, m02 - m20),
        2: (m02 + m20, m12 + m21, squares[2], m10 - m01),
        3: (m21 - m12, m02 - m20, m10 - m01, squares[3]),
    }[largest]
    scale = 0.5 / math.sqrt(squares[largest])
    return Quaternion(*(part * scale for part in off))


def _optical(matrix: Sequence[float]) -> tuple[float, ...]:
    """A camera's frame turned into its optical frame."""
    turned: list[float] = []
    for row in range(3):
        a = matrix[4 * row : 4 * row + 3]
        turned += [sum(a[k] * OPTICAL[3 * k + column] for k in range(3)) for column in range(3)]
        turned.append(matrix[4 * row + 3])
    return (*turned, 0.0, 0.0, 0.0, 1.0)
