"""The walls of the core agent towards the robot's body: virtual effector e_body, virtual receptors r_cam and r_body.

Frames are REP 105's: base_link the robot on the ground, odom where it was switched on, map the world. Units are REP 103's.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class Pose2D:
    """A pose on the ground: m, m, rad (anticlockwise)."""

    x: float
    y: float
    theta: float


@dataclass(frozen=True)
class JointLimits:
    """Of one joint: angles in rad, greatest speed in rad/s."""

    lower: float
    upper: float
    speed: float


@dataclass(frozen=True)
class Picture:
    """One picture: `data` is BGR, 8 bits each, row by row from the top left."""

    width: int
    height: int
    data: bytes
    stamp: float  # s since the epoch
    camera: str = "top"  # that took it


@dataclass(frozen=True)
class Senses:
    """What the body feels at one moment."""

    joints: Mapping[str, float]  # rad
    sonar: tuple[float, float]  # m, left and right; inf: nothing in reach
    bumpers: tuple[bool, bool]  # left and right foot pressed
    battery: float  # 0..1
    velocity: Pose2D  # m/s, m/s, rad/s in base_link
    fallen: bool  # the torso lies, or is about to


class Movement(Protocol):
    """One motion under way. A motion that is not waited for goes on all the same."""

    def done(self) -> bool:
        """Whether it has ended, one way or another."""

    def wait(self, seconds: float) -> bool:
        """Wait for its end, at most `seconds` s; gives whether it has ended."""

    def result(self) -> bool:
        """Once done: whether the robot has carried it out; False when it was stopped. Raises Refused, Unreachable."""

    def cancel(self) -> None:
        """Stop this motion, and no other; no effect once it has ended. Raises CoreError."""


class Motion(Protocol):
    """Virtual effector e_body as what walks and moves joints. What begins a motion returns at once. Raises CoreError."""

    def move_to(self, x: float, y: float, theta: float) -> Movement:
        """Walk to a pose in the frame of the start, m, m, rad; the robot stands."""

    def move_velocity(self, x: float, y: float, theta: float) -> Movement:
        """Walk with a velocity, m/s, m/s, rad/s, until the next motion or a stop; the robot stands. Ends when it is stopped."""

    def move_joints(self, angles: Mapping[str, float], speed: float) -> Movement:
        """Move joints to angles (rad) with a share of their greatest speed; switches their motors on."""

    def take_posture(self, name: str, speed: float) -> Movement:
        """Take a posture with a share of the greatest speed; switches the motors on."""

    def look_at(self, x: float, y: float, z: float, speed: float) -> Movement:
        """Turn the head with a share of its greatest speed, so that the top camera's middle shows a point in base_link, m.

        Switches the motors on. Raises Refused when the neck does not reach it.
        """

    def relax(self) -> Movement:
        """Switch the motors off."""

    def release(self) -> Movement:
        """Let the robot rest: a safe posture, then the motors off."""

    def stop(self) -> None:
        """Stop all motion now; never waits for a motion under way."""

    def moving(self) -> bool:
        """Whether the robot walks."""

    def standing(self) -> bool:
        """Whether it stands on its feet with its motors on, and so can walk."""

    def postures(self) -> Sequence[str]:
        """Postures that can be taken."""

    def posture(self) -> str:
        """The posture the robot is in, or "Unknown"."""

    def nearest_posture(self) -> str:
        """The posture the robot is in, or the one of its family when limbs without motors have sunk; else "Unknown"."""

    def limits(self) -> Mapping[str, JointLimits]:
        """Every joint, and its limits."""

    def angles(self, joints: Sequence[str]) -> tuple[float, ...]:
        """Where joints are now, rad."""

    def pose(self) -> Pose2D:
        """Pose of base_link in odom."""

    def transform(self, name: str, space: int) -> tuple[float, ...]:
        """Homogeneous matrix, 16 numbers row by row, of a joint, chain or sensor in space 0 torso, 1 world (odom), 2 robot."""


class Feeling(Protocol):
    """Virtual receptor r_body."""

    def senses(self) -> Senses:
        """What the body feels now. Raises Refused, Unreachable."""

    def touched(self) -> bool:
        """Whether a hand lies on the middle of its head, which is how people stop it. Raises Refused, Unreachable."""

    def close(self) -> None:
        """Let the sonars be quiet; the next `senses` wakes them. No error when the robot is away."""


class Camera(Protocol):
    """Virtual receptor r_cam; cameras are "top" and "bottom", resolutions 0 QQVGA to 3 4VGA."""

    def capture(self, camera: str, resolution: int) -> Picture:
        """A picture taken now. Raises Refused, Unreachable."""

    def set_parameter(self, camera: str, parameter: int, value: int) -> None:
        """Set a parameter by NAOqi's number. Raises Refused for a number or value that the camera does not have."""

    def close(self) -> None:
        """Let the cameras be idle; the next `capture` wakes its own. No error when the robot is away."""
