"""Between the core agent's values and ROS messages: what is a message only at the edge is no message inside."""

import math
from collections.abc import Mapping
from typing import Any

import geometry_msgs.msg
import rospy
import sensor_msgs.msg

from rapp_core.body_ports import Picture, Pose2D
from rapp_core.services.place import Waypoint

MAP = "map"


def fields(message: Any) -> dict[str, Any]:
    """The fields of a request or a goal; poses become `Pose2D` and `Waypoint`, all else stays."""
    return {name: _taken(getattr(message, name)) for name in message.__slots__ if not name.startswith("_")}


def fill(message: Any, values: Mapping[str, Any]) -> Any:
    """Set fields of a response, a result or a feedback; poses are in frame map. Gives the message."""
    types = dict(zip(message.__slots__, message._slot_types, strict=True))
    for name, value in values.items():
        setattr(message, name, _given(value, types[name]))
    return message


def _taken(value: Any) -> Any:
    if isinstance(value, geometry_msgs.msg.Pose):
        return on_ground(value)
    if isinstance(value, list) and value and isinstance(value[0], geometry_msgs.msg.PoseStamped):
        return [Waypoint(each.header.frame_id.lstrip("/"), on_ground(each.pose)) for each in value]
    return value


def _given(value: Any, wanted: str) -> Any:
    if isinstance(value, Pose2D):
        return stamped(value) if wanted == "geometry_msgs/PoseStamped" else pose(value)
    if isinstance(value, Picture):
        return image(value)
    return value


def on_ground(message: Any) -> Pose2D:
    """geometry_msgs/Pose as seen from above; not a number when its quaternion is none."""
    q = message.orientation
    norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w
    if not norm > 0:
        return Pose2D(message.position.x, message.position.y, math.nan)
    theta = math.atan2(2 * (q.w * q.z + q.x * q.y), norm - 2 * (q.y * q.y + q.z * q.z))
    return Pose2D(message.position.x, message.position.y, theta)


def pose(place: Pose2D) -> Any:
    """geometry_msgs/Pose."""
    message = geometry_msgs.msg.Pose()
    message.position.x, message.position.y = place.x, place.y
    message.orientation.z, message.orientation.w = math.sin(place.theta / 2), math.cos(place.theta / 2)
    return message


def stamped(place: Pose2D) -> Any:
    """geometry_msgs/PoseStamped of this moment in frame map."""
    message = geometry_msgs.msg.PoseStamped(pose=pose(place))
    message.header.stamp, message.header.frame_id = rospy.Time.now(), MAP
    return message


def image(picture: Picture) -> Any:
    """sensor_msgs/Image, bgr8."""
    message = sensor_msgs.msg.Image(height=picture.height, width=picture.width, encoding="bgr8", step=3 * picture.width)
    message.header.stamp, message.header.frame_id = rospy.Time.from_sec(picture.stamp), f"camera_{picture.camera}_optical_frame"
    message.data = picture.data
    return message
