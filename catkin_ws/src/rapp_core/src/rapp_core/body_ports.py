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


@dataclass(frozen=True)
class Senses:
    """What the body feels at one moment."""

    joints: Mapping[str, float]  # rad
    sonar: tuple[float, float]  # m, left and right; inf: nothing in reach
    bumpers: tuple[bool, bool]  # left and right foot pressed
    battery: float  # 0..1
    velocity: Pose2D  # m/s, m/s, rad/s in base_link
    fallen: bool


class Movement(Protocol):
    """One motion under way."""

    def done(self) -> bool:
        """Whether it has ended, one way or another."""

    def result(self) -> bool:
        """Once done: whether its goal is reached; False when it was stopped. Raises Refused, Unreachable."""


class Motion(Protocol):
    """Virtual effector e_body as what walks and moves joints. What begins a motion returns at once. Raises CoreError."""

    def move_to(self, x: float, y: float, theta: float) -> Movement:
        """Walk to a pose in the frame of the start, m, m, rad."""

    def move_velocity(self, x: float, y: float, theta: float) -> None:
        """Walk with a velocity, m/s, m/s, rad/s, until the next motion or `stop`."""

    def move_joints(self, angles: Mapping[str, float], speed: float) -> Movement:
        """Move joints to angles (rad) with a share of their greatest speed; switches their motors on."""

    def take_posture(self, name: str, speed: float) -> Movement:
        """Take a posture with a share of the greatest speed; switches the motors on."""

    def look_at(self, x: float, y: float, z: float) -> Movement:
        """Turn the head towards a point in base_link, m. Raises Refused when the neck does not reach it."""

    def rest(self, posture: str) -> Movement:
        """Take a resting posture, then switch the motors off."""

    def stop(self) -> None:
        """Stop all motion now; never waits for a motion under way."""

    def moving(self) -> bool:
        """Whether a motion is under way."""

    def postures(self) -> Sequence[str]:
        """Postures that can be taken."""

    def posture(self) -> str:
        """The posture the robot is in, or "Unknown"."""

    def limits(self, joints: Sequence[str]) -> Mapping[str, JointLimits]:
        """Limits of joints. Raises Refused for a name the robot does not have."""

    def pose(self) -> Pose2D:
        """Pose of base_link in odom."""

    def transform(self, name: str, space: int) -> tuple[float, ...]:
        """Homogeneous matrix, 16 numbers row by row, of a joint, chain or sensor in space 0 torso, 1 world (odom), 2 robot."""


class Feeling(Protocol):
    """Virtual receptor r_body."""

    def senses(self) -> Senses:
        """What the body feels now. Raises Unreachable."""


class Camera(Protocol):
    """Virtual receptor r_cam; cameras are "top" and "bottom", resolutions 0 QQVGA to 3 4VGA."""

    def capture(self, camera: str, resolution: int) -> Picture:
        """A picture taken now. Raises Refused, Unreachable."""

    def set_parameter(self, camera: str, parameter: int, value: int) -> None:
        """Set a parameter by NAOqi's number. Raises Refused for one that the camera does not have."""
