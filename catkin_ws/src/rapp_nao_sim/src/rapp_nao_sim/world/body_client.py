"""Commands to the robot's body in the physics process, and what is asked of it."""

import math
from collections.abc import Sequence
from typing import Any

from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.frames import Stance
from rapp_nao_sim.world.keys import Feelings
from rapp_nao_sim.world.worker import Worker

MOVE_TIMEOUT = 30.0  # s, more than any movement at full speed takes, with its planning
WALK_PATIENCE = 100.0  # s per m or rad of a way; the walk itself gives up before


class BodyClient:
    """The body; m, rad, s, in the room's frame. Every call is bounded, and raises Refused or Unreachable."""

    def __init__(self, physics: Worker) -> None:
        self._physics = physics

    def robot_pose(self) -> tuple[float, float, float]:
        """x and y of the middle of the soles, and the heading."""
        return self._tuple("robot_pose")

    def link(self, name: str) -> list[float]:
        """Where a link truly is: its frame, or the torso's, as 4x4 matrix row by row."""
        matrix: list[float] = self._physics.call("link", name)
        return matrix

    def clock(self) -> float:
        """Seconds that were simulated so far."""
        return float(self._physics.call("clock"))

    def velocity(self) -> tuple[float, float, float]:
        """Ahead, to the left and turning; of the step under way, or of the torso when it does not walk."""
        return self._tuple("velocity")

    def joint_angles(self, names: Sequence[str]) -> list[float]:
        """What the joints' sensors read."""
        return self._list("joint_angles", names)

    def commanded_angles(self, names: Sequence[str]) -> list[float]:
        """Where the motors are told to be now."""
        return self._list("commanded_angles", names)

    def stiffnesses(self, names: Sequence[str]) -> list[float]:
        """Shares of the motors' torque, 0 to 1."""
        return self._list("stiffnesses", names)

    def set_stiffness(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Set shares of the motors' torque, 0 to 1."""
        self._physics.call("set_stiffness", list(names), list(values))

    def set_joints(self, names: Sequence[str], angles: Sequence[float], fraction: float) -> None:
        """Send joints to angles at a fraction of their greatest speed; does not wait. Angles beyond a range become its end."""
        self._physics.call("set_joints", list(names), list(angles), fraction)

    def move_joints(self, names: Sequence[str], angles: Sequence[Sequence[float]], times: Sequence[Sequence[float]]) -> bool:
        """Send each joint through its angles at its times, and wait; false when something stopped it."""
        longest = max((max(when, default=0.0) for when in times), default=0.0)
        args = list(names), [list(way) for way in angles], [list(when) for when in times]
        return bool(self._physics.call("move_joints", *args, timeout=MOVE_TIMEOUT + longest))

    def set_posture(self, name: str, speed: float) -> bool:
        """Take a posture at a speed from 0 to 1, and wait; gives whether it is reached."""
        if not 0 < speed <= 1:
            raise Refused(f"cannot take a posture at speed {speed:g}; give more than 0 and at most 1")
        return bool(self._physics.call("set_posture", name, speed, timeout=MOVE_TIMEOUT / speed))

    def posture(self) -> tuple[str, str]:
        """Name ("Unknown" in between) and family of the posture the body is in."""
        name, family = self._physics.call("posture")
        return str(name), str(family)

    def wake_up(self) -> bool:
        """Stiffen the joints and stand up, and wait; gives whether it stands."""
        return bool(self._physics.call("wake_up", timeout=MOVE_TIMEOUT))

    def rest(self) -> bool:
        """Crouch, remove the stiffness, and wait; false when something stopped it."""
        return bool(self._physics.call("rest", timeout=MOVE_TIMEOUT))

    def walk_to(self, points: Sequence[Sequence[float]], share: float, lift: float) -> bool:
        """Walk to poses (x, y, theta) seen from where the robot is, one after another, at a share of full speed, lifting the feet
        by `lift`; waits, and gives whether it arrived.
        """
        poses = [list(point) for point in points]
        far = sum(abs(part) for pose in poses for part in pose)
        timeout = MOVE_TIMEOUT + (WALK_PATIENCE * far / share if math.isfinite(far) else 0.0)
        return bool(self._physics.call("walk_to", poses, share, lift, timeout=timeout))

    def walk_at(self, velocity: Sequence[float], share: float, lift: float) -> None:
        """Walk at a velocity (m/s ahead and to the left, rad/s) until told otherwise."""
        self._physics.call("walk_at", list(velocity), share, lift)

    def walking(self) -> bool:
        """Whether the robot walks."""
        return bool(self._physics.call("walking"))

    def wait_for_walk(self, seconds: float) -> None:
        """Wait until the robot does not walk any more."""
        self._physics.call("wait_for_walk", timeout=seconds)

    def stop_walk(self) -> None:
        """Come to stand at once."""
        self._physics.call("stop_walk")

    def swing_arms(self, left: bool, right: bool) -> None:
        """Whether the arms swing in walks."""
        self._physics.call("swing_arms", left, right)

    def odometry(self, use_sensors: bool = True) -> tuple[float, float, float]:
        """Where the robot believes to be by its legs' sensors or commands, in the frame where it was first."""
        return self._tuple("odometry" if use_sensors else "planned_pose")

    def stance(self, use_sensors: bool = True) -> Stance:
        """What tells where the body's parts are: joints as sensed or as commanded, the vertical, the odometry."""
        stance: Stance = self._physics.call("stance", use_sensors)
        return stance

    def next_pose(self) -> tuple[float, float, float]:
        """Where it believes to be after its present step."""
        return self._tuple("next_pose")

    def stop_joints(self, names: Sequence[str]) -> None:
        """End the movement of joints; who waits for it hears false."""
        self._physics.call("stop_joints", list(names))

    def busy(self, names: Sequence[str]) -> bool:
        """Whether a command moves any of these joints."""
        return bool(self._physics.call("busy", list(names)))

    def tasks(self) -> list[tuple[str, int, list[str]]]:
        """What is under way: what it is, its number, the joints it moves."""
        tasks: list[tuple[str, int, list[str]]] = self._physics.call("tasks")
        return tasks

    def stop_posture(self) -> None:
        """End a change of posture; who waits for it hears false."""
        self._physics.call("stop_posture")

    def stop(self) -> None:
        """End all movement; who waits for it hears false."""
        self._physics.call("stop")

    def is_moving(self) -> bool:
        """Whether a command is under way."""
        return bool(self._physics.call("is_moving"))

    def awake(self) -> bool:
        """Whether the legs have stiffness."""
        return bool(self._physics.call("awake"))

    def fallen(self) -> bool:
        """Whether the robot lies without having been told to."""
        return bool(self._physics.call("fallen"))

    def push(self, force: Sequence[float], seconds: float = 0.1) -> None:
        """Push the torso with a force in N along the room's axes."""
        self._physics.call("push", list(force), seconds)

    def take_touched(self) -> list[str]:
        """What of the room, but for the floor, the robot has touched since this was asked the last time."""
        touched: list[str] = self._physics.call("take_touched")
        return touched

    def feelings(self) -> Feelings:
        """What the robot feels now; see `keys.values`."""
        feelings: Feelings = self._physics.call("feelings")
        return feelings

    def events(self) -> list[tuple[str, Any]]:
        """Wait for the next events of the senses (key of ALMemory, value), in their order; after a while there may be none."""
        events: list[tuple[str, Any]] = self._physics.call("events")
        return events

    def touch(self, name: str, seconds: float) -> None:
        """Touch one of `keys.TOUCHES` for a time; does not wait."""
        self._physics.call("touch", name, seconds)

    def set_charge(self, charge: float) -> None:
        """Set the battery's charge from 0 to 1."""
        self._physics.call("set_charge", charge)

    def set_sonar(self, on: bool) -> None:
        """Whether the sonars measure."""
        self._physics.call("set_sonar", on)

    def protect(self, side: str, on: bool) -> None:
        """Whether an arm ("L" or "R") is kept out of the body."""
        self._physics.call("protect", side, on)

    def guard(self, what: str, on: bool) -> None:
        """Whether "bumpers" stop the walk, and "falls" take the stiffness away."""
        self._physics.call("guard", what, on)

    def _tuple(self, verb: str) -> tuple[float, float, float]:
        x, y, turn = self._physics.call(verb)
        return float(x), float(y), float(turn)

    def _list(self, verb: str, names: Sequence[str]) -> list[float]:
        values: Any = self._physics.call(verb, list(names))
        return [float(value) for value in values]
