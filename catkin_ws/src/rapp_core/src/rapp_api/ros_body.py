"""Navigation and vision over ROS: the part of `ros_core_agent` that moves the body and sees."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import geometry_msgs.msg

from rapp_api.poses import Pose
from rapp_api.ros_actions import ActionClient


class RosBody(ABC):
    """See `core_agent.CoreAgent`."""

    _header: dict[str, str]

    @abstractmethod
    def _call(self, name: str, srv: str, /, **fields: Any) -> Any:
        """Call a service; gives its response. Raises RappError."""

    def move_to(self, x: float, y: float, theta: float) -> None:
        """See `CoreAgent`."""
        self._call("rapp_move_to", "MoveTo", x=x, y=y, theta=theta)

    def move_vel(self, x: float, y: float, theta: float) -> str:
        """See `CoreAgent`."""
        return str(self._call("rapp_move_vel", "MoveVel", x=x, y=y, theta=theta).message)

    def move_stop(self) -> str:
        """See `CoreAgent`."""
        return str(self._call("rapp_move_stop", "MoveStop").message)

    def move_joint(self, joints: Sequence[str], angles: Sequence[float], speed: float) -> None:
        """See `CoreAgent`."""
        self._call("rapp_move_joint", "MoveJoint", joints=list(joints), angles=list(angles), speed=speed)

    def take_posture(self, posture: str, speed: float) -> None:
        """See `CoreAgent`."""
        self._call("rapp_take_predefined_posture", "TakePosture", posture=posture, speed=speed)

    def look_at_point(self, x: float, y: float, z: float) -> None:
        """See `CoreAgent`."""
        self._call("rapp_look_at_point", "LookAtPoint", x=x, y=y, z=z)

    def rest(self, posture: str) -> None:
        """See `CoreAgent`."""
        self._call("rapp_rest", "Rest", posture=posture)

    def move_along_path(self, path: Sequence[Pose]) -> None:
        """See `CoreAgent`."""
        self._call("rapp_move_along_path", "MoveAlongPath", poses=[_stamped(pose) for pose in path])

    def set_global_pose(self, pose: Pose) -> None:
        """See `CoreAgent`."""
        self._call("rapp_set_global_pose", "SetGlobalPose", pose=_message(pose))

    def get_robot_pose(self) -> Pose:
        """See `CoreAgent`."""
        found = self._call("rapp_get_robot_pose", "GetRobotPose").pose
        place, turn = found.pose.position, found.pose.orientation
        return Pose(place.x, place.y, 2 * math.atan2(turn.z, turn.w), found.header.frame_id)

    def get_transform(self, name: str, space: int) -> Sequence[float]:
        """See `CoreAgent`."""
        return tuple(self._call("rapp_get_transform", "GetTransform", name=name, space=space).transform)

    def capture_image(self, camera: str, resolution: int) -> tuple[int, int, bytes]:
        """See `CoreAgent`."""
        frame = self._call("rapp_capture_image", "CaptureImage", camera=camera, resolution=resolution).frame
        return frame.width, frame.height, frame.data

    def set_camera_param(self, camera: int, parameter: int, value: int) -> None:
        """See `CoreAgent`."""
        self._call("rapp_set_camera_param", "SetCameraParam", camera=camera, parameter=parameter, value=value)

    def set_camera_params(self, camera: int, parameters: Sequence[int], values: Sequence[int]) -> list[bool]:
        """See `CoreAgent`."""
        fields = {"camera": camera, "parameters": list(parameters), "values": list(values)}
        return list(map(bool, self._call("rapp_set_camera_params", "SetCameraParams", **fields).accepted))

    def action_client(self, name: str) -> ActionClient:
        """See `CoreAgent`."""
        return ActionClient(name, self._header)


def _message(pose: Pose) -> Any:
    message = geometry_msgs.msg.Pose()
    message.position.x, message.position.y = pose.x, pose.y
    message.orientation.z, message.orientation.w = math.sin(pose.theta / 2), math.cos(pose.theta / 2)
    return message


def _stamped(pose: Pose) -> Any:
    message = geometry_msgs.msg.PoseStamped(pose=_message(pose))
    message.header.frame_id = pose.frame
    return message
