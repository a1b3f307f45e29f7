"""The body of the robot in memory: walks, turns and takes postures while the clock's time passes."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rapp_core.body_ports import JointLimits, Picture, Pose2D, Senses
from rapp_core.errors import Invalid, Refused

if TYPE_CHECKING:
    from fakes.robot import Body

LIMITS = {
    "HeadYaw": JointLimits(-2.0857, 2.0857, 8.268),
    "HeadPitch": JointLimits(-0.672, 0.5149, 7.194),
    "LShoulderPitch": JointLimits(-2.0857, 2.0857, 8.268),
    "LKneePitch": JointLimits(-0.0923, 2.1126, 6.402),
}
POSTURES = ("Stand", "StandInit", "Crouch", "Sit", "LyingBelly")
SPEED = 0.1  # m/s
TURNING = 0.5  # rad/s
POSTURE_TIME = 2.0  # s
JOINT_TIME = 1.0  # s
SIZES = {0: (160, 120), 1: (320, 240), 2: (640, 480), 3: (1280, 960)}
PARAMETERS = {0: (0, 255), 1: (16, 64), 17: (1, 2500)}


class FakeMovement:
    """Ends at a time of the clock, or when it is stopped; then `then` is done, if it was not stopped."""

    def __init__(self, body: "Body", seconds: float, then: Callable[[], None], stopped: Callable[[], None]) -> None:
        self._body = body
        self._then = then
        self._on_stop = stopped
        self._ended: bool | None = None
        if math.isfinite(seconds):
            body.clock.after(seconds, self._arrive)

    def _arrive(self) -> None:
        if self._ended is None:
            self._ended = True
            self._then()

    def halt(self) -> None:
        if self._ended is None:
            self._ended = False
            self._on_stop()

    def done(self) -> bool:
        return self._ended is not None

    def wait(self, seconds: float) -> bool:
        if not self.done():
            self._body.clock.advance(seconds)
        return self.done()

    def result(self) -> bool:
        self._body.note("")
        return bool(self._ended)

    def cancel(self) -> None:
        if not self.done():
            self._body.note("cancel")
            self.halt()


class FakeMotion:
    """`slip` is the share of a walk that the robot does not make."""

    def __init__(self, body: "Body") -> None:
        self._body = body
        self._running: list[FakeMovement] = []
        self._walk: tuple[float, float, Pose2D, Pose2D] | None = None  # begin, seconds, pose then, way in its frame
        self._pose = Pose2D(0.0, 0.0, 0.0)
        self.angle = dict.fromkeys(LIMITS, 0.0)
        self.at = "StandInit"
        self.awake = True
        self.slip = 0.0

    def move_to(self, x: float, y: float, theta: float) -> FakeMovement:
        self._body.note(f"moveTo {x:.2f} {y:.2f} {theta:.2f}")
        seconds = max(math.hypot(x, y) / SPEED, abs(theta) / TURNING)
        return self._walk_for(seconds, Pose2D(x, y, theta), 1.0 - self.slip)

    def move_velocity(self, x: float, y: float, theta: float) -> FakeMovement:
        self._body.note(f"move {x:g} {y:g} {theta:g}")
        return self._walk_for(math.inf, Pose2D(x, y, theta), 1.0)

    def _walk_for(self, seconds: float, way: Pose2D, share: float) -> FakeMovement:
        self._rest_walk()
        way = Pose2D(way.x * share, way.y * share, way.theta * share)
        self._walk = (self._body.clock.time, seconds, self._pose, way)
        return self._begin(seconds, self._rest_walk)

    def _rest_walk(self) -> None:
        self._pose, self._walk = self.pose(), None

    def move_joints(self, angles: Mapping[str, float], speed: float) -> FakeMovement:
        self._body.note("joints " + " ".join(f"{name} {angle:.2f}" for name, angle in angles.items()) + f" at {speed:g}")
        return self._begin(JOINT_TIME, lambda: self.angle.update(angles))

    def take_posture(self, name: str, speed: float) -> FakeMovement:
        if name not in POSTURES:
            raise Refused(f"cannot take posture {name}")
        self._body.note(f"posture {name} at {speed:g}")
        self.at, self.awake = "Unknown", True
        return self._begin(POSTURE_TIME, lambda: setattr(self, "at", name))

    def look_at(self, x: float, y: float, z: float, speed: float) -> FakeMovement:
        if x < -1:
            raise Refused("cannot look there: the neck does not reach it")
        self._body.note(f"look {x:g} {y:g} {z:g} at {speed:g}")
        return self._begin(JOINT_TIME, lambda: self.angle.update(HeadYaw=math.atan2(y, x)))

    def relax(self) -> FakeMovement:
        self._body.note("relax")
        return self._begin(0.5, lambda: setattr(self, "awake", False))

    def release(self) -> FakeMovement:
        self._body.note("rest")
        self.at, self.awake = "Crouch", False
        return self._begin(POSTURE_TIME, lambda: None)

    def stop(self) -> None:
        self._body.note("stop motion")
        for movement in self._running:
            movement.halt()

    def _begin(self, seconds: float, then: Callable[[], None]) -> FakeMovement:
        movement = FakeMovement(self._body, seconds, then, self._rest_walk)
        self._running = [each for each in self._running if not each.done()] + [movement]
        return movement

    def shift(self, x: float) -> None:
        """A robot that stands is moved along its odom by so many m."""
        self._pose = Pose2D(self._pose.x + x, self._pose.y, self._pose.theta)

    def moving(self) -> bool:
        return self._walk is not None

    def standing(self) -> bool:
        return self.awake and self.at.startswith("Stand")

    def postures(self) -> Sequence[str]:
        return POSTURES

    def posture(self) -> str:
        return self.at

    def nearest_posture(self) -> str:
        return self.at

    def limits(self) -> Mapping[str, JointLimits]:
        return LIMITS

    def angles(self, joints: Sequence[str]) -> tuple[float, ...]:
        return tuple(self.angle[name] for name in joints)

    def pose(self) -> Pose2D:
        if self._walk is None:
            return self._pose
        begin, seconds, start, way = self._walk
        passed = self._body.clock.time - begin
        share = passed if math.isinf(seconds) else min(1.0, passed / seconds) if seconds else 1.0
        cos, sin = math.cos(start.theta), math.sin(start.theta)
        x, y, theta = way.x * share, way.y * share, way.theta * share
        return Pose2D(start.x + cos * x - sin * y, start.y + sin * x + cos * y, start.theta + theta)

    def transform(self, name: str, space: int) -> tuple[float, ...]:
        if name not in (*LIMITS, "Head", "Torso", "CameraTop"):
            raise Invalid(f"cannot find {name!r} on this robot; give a joint, a chain or a sensor")
        self._body.note("")
        return (1.0, 0.0, 0.0, float(space), 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.4, 0.0, 0.0, 0.0, 1.0)


class FakeFeeling:
    """`feel` changes what the body feels; `asked` counts how often it was."""

    def __init__(self, body: "Body", motion: FakeMotion) -> None:
        self._body = body
        self._motion = motion
        self.asked = 0
        self.hand = False  # on its head
        self.now = Senses({}, (math.inf, math.inf), (False, False), 0.9, Pose2D(0.0, 0.0, 0.0), fallen=False)

    def feel(self, **changes: object) -> None:
        self.now = replace(self.now, **changes)  # type: ignore[arg-type]

    def senses(self) -> Senses:
        self._body.note("")
        self.asked += 1
        return replace(self.now, joints=dict(self._motion.angle))

    def touched(self) -> bool:
        return self.hand

    def close(self) -> None:
        """Nothing to do."""


class FakeCamera:
    """Pictures of one colour: blue as brightness says, red 200 for the bottom camera."""

    def __init__(self, body: "Body") -> None:
        self._body = body
        self.values = {(camera, number): low for camera in ("top", "bottom") for number, (low, _) in PARAMETERS.items()}

    def capture(self, camera: str, resolution: int) -> Picture:
        self._body.note(f"capture {camera} {resolution}")
        width, height = SIZES[resolution]
        pixel = bytes([self.values[camera, 0], 0, 200 if camera == "bottom" else 0])
        return Picture(width, height, pixel * (width * height), self._body.clock.time, camera)

    def set_parameter(self, camera: str, parameter: int, value: int) -> None:
        least, most = PARAMETERS.get(parameter, (1, 0))
        if not least <= value <= most:
            raise Refused(f"cannot set parameter {parameter} of the {camera} camera to {value}")
        self._body.note(f"parameter {camera} {parameter} {value}")
        self.values[camera, parameter] = value

    def close(self) -> None:
        """Nothing to do."""
