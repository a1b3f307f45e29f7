"""The body of the core agent for authors' tests: it is where it was told to go at once; see `testing`."""

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rapp_api.errors import Invalid, RappError, Refused
from rapp_api.poses import Pose

POSTURES = ("Stand", "StandInit", "StandZero", "Crouch", "Sit", "SitRelax", "LyingBelly", "LyingBack")
RESTING = ("Sit", "SitRelax", "Crouch", "LyingBelly", "LyingBack")
ACTIONS = {
    "rapp_move_to": "move_to",
    "rapp_move_along_path": "move_along_path",
    "rapp_take_predefined_posture": "take_posture",
    "rapp_move_joint": "move_joint",
}
"""Functions by the names of their actions."""
SIZES = {0: (160, 120), 1: (320, 240), 2: (640, 480), 3: (1280, 960)}
FASTEST = {"x": 0.1, "y": 0.06, "theta": 0.5}  # m/s, m/s, rad/s
FARTHEST = 10.0  # m of one walk
LARGEST = 3.4e38  # of single precision
SUCCEEDED, ABORTED = 3, 4  # of actionlib_msgs/GoalStatus
_SIDES = {
    "ShoulderPitch": (-2.0857, 2.0857), "ElbowYaw": (-2.0857, 2.0857), "WristYaw": (-1.8239, 1.8239), "Hand": (0.0, 1.0),
    "HipYawPitch": (-1.1453, 0.7407), "HipPitch": (-1.5359, 0.484), "KneePitch": (-0.0923, 2.1126),
}  # fmt: skip
JOINTS = {
    "HeadYaw": (-2.0857, 2.0857), "HeadPitch": (-0.672, 0.5149),
    **{side + name: limits for side in "LR" for name, limits in _SIDES.items()},
    "LShoulderRoll": (-0.3142, 1.3265), "RShoulderRoll": (-1.3265, 0.3142), "LElbowRoll": (-1.5446, -0.0349),
    "RElbowRoll": (0.0349, 1.5446), "LHipRoll": (-0.3794, 0.7905), "RHipRoll": (-0.7905, 0.3794),
    "LAnklePitch": (-1.1894, 0.9226), "RAnklePitch": (-1.1863, 0.932), "LAnkleRoll": (-0.3978, 0.769),
    "RAnkleRoll": (-0.769, 0.3978),
}  # fmt: skip
"""Joints of a NAO and their ranges, rad."""
PARTS = (
    *JOINTS, "Head", "LArm", "RArm", "LLeg", "RLeg", "Torso", "CameraTop", "CameraBottom",
    "MicroFront", "MicroRear", "MicroLeft", "MicroRight", "Accelerometer", "Gyrometer",
)  # fmt: skip
"""What `get_transform` knows."""
PARAMETERS = {
    0: (0, 255), 1: (16, 64), 2: (0, 255), 3: (-180, 180), 6: (32, 255), 7: (0, 1), 8: (0, 1), 11: (0, 1), 12: (0, 1),
    17: (1, 2500), 18: (0, 1), 19: (0, 1), 22: (0, 3), 24: (-1, 7), 33: (2700, 6500), 34: (0, 4), 35: (0, 1),
}  # fmt: skip
"""Parameters of a NAO's cameras and their ranges; that some exclude each other is not told here."""

Image = NDArray[np.uint8]


class FakeBody:
    """The robot's body as the RApp moves it; `FakeCoreAgent` is one."""

    calls: list[tuple[str, Any]]

    def __init__(self, pictures: Sequence[Image] = (), walks: Sequence[RappError | None] = ()) -> None:
        self.pose = Pose(0.0, 0.0, 0.0)
        self.posture = "Crouch"
        self.joints = dict.fromkeys(JOINTS, 0.0)
        self.velocity = (0.0, 0.0, 0.0)
        self._pictures = list(pictures)
        self._walks = list(walks)

    def _permit(self, name: str) -> None:
        """Raise Refused when the RApp may not call a service."""

    def move_to(self, x: float, y: float, theta: float) -> None:
        """Be there, or end as `walks` says."""
        self._begin("rapp_move_to", "move_to", (x, y, theta))
        _check(_finite(x, y, theta), "walk there: x, y and theta must be numbers")
        self._walk([Pose(x, y, theta, "base_link")])

    def move_vel(self, x: float, y: float, theta: float) -> str:
        """Note the velocity; no time passes, so nothing has ended the walk before."""
        self._begin("rapp_move_vel", "move_vel", (x, y, theta))
        _check(_finite(x, y, theta), "walk so: x, y and theta must be numbers")
        for (name, most), value in zip(FASTEST.items(), (x, y, theta), strict=True):
            if abs(value) > most:
                raise Refused(f"cannot walk with {name} {value:g}: -{most:g} to {most:g} are allowed")
        self.posture, self.velocity = "StandInit", (x, y, theta)
        return ""

    def move_stop(self) -> str:
        """Walk no more."""
        self._begin("rapp_move_stop", "move_stop", None)
        self.velocity = (0.0, 0.0, 0.0)
        return ""

    def move_joint(self, joints: Sequence[str], angles: Sequence[float], speed: float) -> None:
        """Have the joints there."""
        self._begin("rapp_move_joint", "move_joint", dict(zip(joints, angles, strict=False)))
        _check(bool(joints) and len(joints) == len(angles) == len(set(joints)), "move joints: give one angle for each")
        _check(0 <= speed <= 1, "move: speed is a share from 0 to 1")
        for joint, angle in zip(joints, angles, strict=True):
            _check(joint in JOINTS, f"move {joint!r}: this robot's joints are {', '.join(JOINTS)}")
            _check(JOINTS[joint][0] <= angle <= JOINTS[joint][1], f"move {joint} to {angle:g}: its range is {JOINTS[joint]}")
        self.joints.update(zip(joints, angles, strict=True))

    def take_posture(self, posture: str, speed: float) -> None:
        """Be in it."""
        self._begin("rapp_take_predefined_posture", "take_posture", posture)
        _check(posture in POSTURES, f"take posture {posture!r}: known are {', '.join(POSTURES)}")
        _check(0 <= speed <= 1, "move: speed is a share from 0 to 1")
        self.posture = posture

    def look_at_point(self, x: float, y: float, z: float) -> None:
        """Note the point."""
        self._begin("rapp_look_at_point", "look_at_point", (x, y, z))
        _check(_finite(x, y, z), "look there: x, y and z must be numbers")
        if abs(math.atan2(y, x)) > JOINTS["HeadYaw"][1]:
            raise Refused(f"cannot look at ({x:g}, {y:g}, {z:g}): the neck does not reach it")

    def rest(self, posture: str) -> None:
        """Be in the posture."""
        self._begin("rapp_rest", "rest", posture)
        _check(posture in ("", *RESTING), f"rest in posture {posture!r}: known are {', '.join(RESTING)}")
        self.posture = posture or RESTING[0]

    def move_along_path(self, path: Sequence[Pose]) -> None:
        """Be at its end, or end as `walks` says."""
        self._begin("rapp_move_along_path", "move_along_path", list(path))
        _check(1 <= len(path) <= 100, "walk along a path: 1 to 100 poses are possible")
        for pose in path:
            _check(pose.frame in ("map", "odom", "base_link"), f"use frame {pose.frame!r}: known are map, odom, base_link")
            _check(_finite(pose.x, pose.y, pose.theta), "use a pose: its position and orientation must be numbers")
        self._walk(path)

    def set_global_pose(self, pose: Pose) -> None:
        """Be there."""
        self._begin("rapp_set_global_pose", "set_global_pose", pose)
        _check(_finite(pose.x, pose.y, pose.theta), "take this pose: its position and orientation must be numbers")
        self.pose = Pose(pose.x, pose.y, pose.theta)

    def get_robot_pose(self) -> Pose:
        """Where it was told to go."""
        self._begin("rapp_get_robot_pose", "get_robot_pose", None)
        return self.pose

    def get_transform(self, name: str, space: int) -> Sequence[float]:
        """Upright, half a metre above the ground."""
        self._begin("rapp_get_transform", "get_transform", (name, space))
        _check(name in PARTS, f"find {name!r} on this robot; give one of {', '.join(PARTS)}")
        _check(space in (0, 1, 2), f"use space {space}: known are 0 torso, 1 world, 2 robot")
        return (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.5 if space else 0.0, 0.0, 0.0, 0.0, 1.0)

    def capture_image(self, camera: str, resolution: int) -> tuple[int, int, bytes]:
        """The next of `pictures`; a dark one of the wanted size when there is none left."""
        self._begin("rapp_capture_image", "capture_image", camera)
        _check(camera in ("top", "bottom"), f"use camera {camera!r}: known are top, bottom")
        _check(resolution in SIZES, f"use resolution {resolution}: known are 0 QQVGA, 1 QVGA, 2 VGA, 3 4VGA")
        width, height = SIZES[resolution]
        picture = self._pictures.pop(0) if self._pictures else np.zeros((height, width, 3), np.uint8)
        return picture.shape[1], picture.shape[0], picture.tobytes()

    def set_camera_param(self, camera: int, parameter: int, value: int) -> None:
        """Note it."""
        self._begin("rapp_set_camera_param", "set_camera_param", (camera, parameter, value))
        _check(camera in (0, 1), f"use camera {camera}: known are 0 top, 1 bottom")
        if not _taken(parameter, value):
            ranges = ", ".join(f"{number} {least} to {most}" for number, (least, most) in PARAMETERS.items())
            raise Refused(f"cannot set parameter {parameter} to {value}: possible are {ranges}")

    def set_camera_params(self, camera: int, parameters: Sequence[int], values: Sequence[int]) -> list[bool]:
        """Note them; those are taken that a NAO has."""
        self._begin("rapp_set_camera_params", "set_camera_params", (camera, dict(zip(parameters, values, strict=False))))
        _check(camera in (0, 1), f"use camera {camera}: known are 0 top, 1 bottom")
        _check(1 <= len(parameters) == len(values) <= 100, "set parameters: give one value for each")
        return [_taken(*pair) for pair in zip(parameters, values, strict=True)]

    def action_client(self, name: str) -> "FakeActionClient":
        """A client whose goals end at once."""
        return FakeActionClient(self, name)

    def _begin(self, service: str, name: str, argument: Any) -> None:
        self._permit(service)
        self.calls.append((name, argument))

    def _walk(self, path: Sequence[Pose]) -> None:
        start, goals = self.pose, []
        for pose in path:
            goals.append(_compose(start, pose) if pose.frame == "base_link" else Pose(pose.x, pose.y, pose.theta))
        ways = zip([start, *goals], goals, strict=False)
        if sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in ways) > FARTHEST:
            raise Refused(f"cannot walk that far: {FARTHEST:g} m at a time are allowed; walk in parts")
        outcome = self._walks.pop(0) if self._walks else None
        self.posture = "StandInit"
        if outcome is not None:
            raise outcome
        self.pose = goals[-1]


class FakeActionClient:
    """The part of actionlib.SimpleActionClient that RApps use; `send_goal` carries the goal out at once."""

    def __init__(self, body: FakeBody, name: str) -> None:
        _check(name in ACTIONS, f"make a client of {name}: actions are {', '.join(ACTIONS)}")
        self._work = getattr(body, ACTIONS[name])
        self._error: RappError | None = None

    def wait_for_server(self, _timeout: Any = None) -> bool:
        """It is there."""
        return True

    def send_goal(self, goal: Any, done_cb: Any = None, active_cb: Any = None, feedback_cb: Any = None) -> None:
        """Carry it out."""
        fields = [getattr(goal, name) for name in goal.__slots__]
        try:
            self._work(*([_pose(each) for each in field] if isinstance(field, list) else field for field in fields))
            self._error = None
        except RappError as error:
            self._error = error
        if done_cb is not None:
            done_cb(self.get_state(), self.get_result())

    def wait_for_result(self, _timeout: Any = None) -> bool:
        """It has ended."""
        return True

    def cancel_goal(self) -> None:
        """It has ended already."""

    def get_state(self) -> int:
        """actionlib_msgs/GoalStatus: succeeded or aborted."""
        return ABORTED if self._error is not None else SUCCEEDED

    def get_result(self) -> Any:
        """An object with the fields of the action's result."""
        kind = type(self._error).__name__.lower() if self._error is not None else ""
        return SimpleNamespace(success=self._error is None, message=str(self._error or ""), error=kind)


def _pose(item: Any) -> Any:
    """geometry_msgs/PoseStamped as `Pose`; what is none stays."""
    if not hasattr(item, "pose"):
        return item
    turn = item.pose.orientation
    return Pose(item.pose.position.x, item.pose.position.y, 2 * math.atan2(turn.z, turn.w), item.header.frame_id)


def _compose(frame: Pose, pose: Pose) -> Pose:
    cos, sin = math.cos(frame.theta), math.sin(frame.theta)
    x, y = frame.x + cos * pose.x - sin * pose.y, frame.y + sin * pose.x + cos * pose.y
    return Pose(x, y, math.remainder(frame.theta + pose.theta, math.tau))


def _taken(parameter: int, value: int) -> bool:
    least, most = PARAMETERS.get(parameter, (1, 0))
    return least <= value <= most


def _finite(*values: float) -> bool:
    """Whether all are numbers that a message's field of single precision can hold."""
    try:
        return all(abs(value) <= LARGEST for value in values)
    except TypeError:
        return False


def _check(right: bool, what: str) -> None:
    if not right:
        raise Invalid(f"cannot {what}")
