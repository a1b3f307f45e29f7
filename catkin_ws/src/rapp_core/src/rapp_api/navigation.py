"""Navigation API (deliverable section 4.5.2). m, rad, s; frames as in `Pose`.

The core agent stops a walk, and refuses it by Refused, when a bumper is pressed, an obstacle is too near ahead, or the robot falls;
and whenever this RApp ends. A function that waits is ended early by `move_stop` from another thread: Refused, "stopped".
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rapp_api.core_agent import current
from rapp_api.poses import Pose

TORSO, WORLD, ROBOT = 0, 1, 2
"""Spaces of `get_transform`."""


def move_to(x: float, y: float, theta: float) -> None:
    """Walk to a pose given in the frame of the start, m, m, rad; returns when the robot is there. Raises Refused, Invalid."""
    current().move_to(x, y, theta)


def move_vel(x: float, y: float, theta: float) -> str:
    """Walk with a velocity, m/s, m/s, rad/s; returns at once. The robot takes StandInit first when it is not in it.

    It walks until the next motion of its legs, `move_stop`, or the end of this RApp; a further call only changes the velocity.
    When the core agent stops it, or the robot itself, the next `move_vel` or `move_stop` gives why; else they give "".
    """
    return current().move_vel(x, y, theta)


def move_stop() -> str:
    """Stop all motion now, of all threads of this RApp; gives what had ended a `move_vel`, if anything had (see there)."""
    return current().move_stop()


def move_joint(joints: str | Sequence[str], angles: float | Sequence[float], speed: float = 0.0) -> None:
    """Move joints, such as HeadYaw, to angles (rad), at a share (0..1) of their greatest speed, 0: the core agent's default.

    Switches the motors of these joints on; returns when they are there. Invalid names the joints or the range.
    """
    names = [joints] if isinstance(joints, str) else list(joints)
    goals = list(angles) if isinstance(angles, Sequence) else [angles]
    current().move_joint(names, goals, speed)


def take_predefined_posture(posture: str, speed: float = 0.0) -> None:
    """Take a posture, such as Stand, Sit or Crouch; switches the motors on; returns when it is taken. Invalid names the known."""
    current().take_posture(posture, speed)


def look_at_point(x: float, y: float, z: float) -> None:
    """Turn the head so that the top camera's middle shows a point: m ahead, to the left, above the ground (base_link)."""
    current().look_at_point(x, y, z)


def rest(posture: str = "") -> None:
    """Take a resting posture ("": Sit), and switch the motors off."""
    current().rest(posture)


def move_along_path(path: Sequence[Pose]) -> None:
    """Walk along 1 to 100 poses; returns at the last. "base_link" is that of the start. Raises Refused, Invalid."""
    current().move_along_path(list(path))


def set_global_pose(pose: Pose) -> None:
    """Tell where the robot is in the map; the core agent keeps it up by odometry from there."""
    current().set_global_pose(pose)


def get_robot_pose() -> Pose:
    """Where the robot is in the map; until somebody has told, the map is where it was switched on."""
    return current().get_robot_pose()


def get_transform(name: str, space: int) -> NDArray[np.float64]:
    """The 4x4 homogeneous matrix (m) of a joint, chain or sensor, such as CameraTop, in TORSO, WORLD or ROBOT space."""
    return np.array(current().get_transform(name, space), np.float64).reshape(4, 4)


def action_client(name: str) -> Any:
    """An ordinary actionlib.SimpleActionClient of an action of the core agent.

    There are rapp_move_to, rapp_move_along_path, rapp_take_predefined_posture and rapp_move_joint: the functions of the same names,
    with feedback and cancel. Goals are made of rapp_msgs.msg, such as MoveToGoal. A newer goal ends an older one of the
    same limbs.
    """
    return current().action_client(name)
