"""How joints get from where they are to where they shall be: pure, in seconds and radians."""

from collections.abc import Sequence
from dataclasses import dataclass

from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.model import BODY, JOINTS, TWINS

_POSTURE_SPEED = 0.3  # share of the joints' greatest speed used by posture changes at speed 1
_LEAN_SPEED = 0.8  # rad/s of the torso in posture changes at speed 1
_POSTURE_TIME = 0.5  # s, at least


@dataclass(frozen=True)
class Track:
    """A joint's way through angles at times after `begin`; starts at rest and ends at rest at each of them when `eased`."""

    begin: float
    times: tuple[float, ...]
    angles: tuple[float, ...]  # the first is where it starts
    eased: bool

    @property
    def end(self) -> float:
        """When the last angle is reached."""
        return self.begin + self.times[-1]

    def at(self, now: float) -> float:
        """The angle at a time."""
        since, before = now - self.begin, 0.0
        for i, time in enumerate(self.times):
            if since < time:
                share = max(0.0, (since - before) / (time - before))
                if self.eased:
                    share = ease(share)
                return self.angles[i] + (self.angles[i + 1] - self.angles[i]) * share
            before = time
        return self.angles[-1]


def ease(share: float) -> float:
    """A share from 0 to 1 with a gentle start and end."""
    return share * share * (3 - 2 * share)


def clip(joint: str, angle: float) -> float:
    """The angle, or the end of the joint's range that is nearest to it."""
    return min(JOINTS[joint].upper, max(JOINTS[joint].lower, angle))


def direct(joint: str, now: float, start: float, goal: float, fraction: float) -> Track:
    """To a goal at a fraction of the joint's greatest speed."""
    time = abs(goal - start) / (fraction * JOINTS[joint].speed)
    return Track(now, (max(time, 1e-3),), (start, goal), eased=False)


def through(now: float, start: float, goals: Sequence[float], times: Sequence[float]) -> Track:
    """Through goals at times after now."""
    return Track(now, tuple(times), (start, *goals), eased=True)


def posture_time(start: dict[str, float], goal: dict[str, float], lean: float, speed: float) -> float:
    """Seconds that a change of posture takes, the torso's lean changing by `lean` rad; speed from 0 to 1."""
    joints = max(abs(goal[name] - start[name]) / (_POSTURE_SPEED * JOINTS[name].speed) for name in goal)
    return max(_POSTURE_TIME, joints, abs(lean) / _LEAN_SPEED) / speed


def check(names: Sequence[str], *values: Sequence[object]) -> None:
    """Refuse unknown joints, and values that are not one for each joint, before anything moves."""
    for name in names:
        if name not in JOINTS:
            raise Refused(f"cannot find joint {name!r}: known are {', '.join(BODY)}")
    for row in values:
        if len(row) != len(names):
            raise Refused(f"cannot use {len(row)} values for {len(names)} joints: give one for each")


def twin(name: str) -> tuple[str, ...]:
    """The joint that the same motor drives, if any."""
    return (TWINS[name],) if name in TWINS else ()
