"""Walking: leads the gait to goals by what the odometry says, or at a wished velocity; m, rad, s."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.gait import Gait, Stance, Style, even
from rapp_nao_sim.world.moves import clip
from rapp_nao_sim.world.odometry import Odometry
from rapp_nao_sim.world.poses import Pose, compose, relative

FASTEST: Pose = (0.09, 0.06, 0.5)  # m/s ahead and aside, rad/s; beyond, it falls now and then
MOST_POINTS = 200  # of a way
FARTHEST = 50.0  # m or rad from one point to the next
_CHANGES: Pose = (0.03, 0.02, 0.2)  # of the velocity from one step to the next
_THERE = (0.008, 0.02)  # m and rad from a goal that count as there
_PASSED = (0.06, 0.15)  # from a point on the way
_PATIENCE = 3.0  # times what a way takes at full speed, after which it is given up
_SLACK = 15.0  # s beside
_CALM = 2  # steps on the spot before standing
_SWING = 4.0  # rad of the shoulders per m that the opposite foot is ahead
_STILL: Pose = (0.0, 0.0, 0.0)
_SHOULDERS = {"LShoulderPitch": 1.0, "RShoulderPitch": -1.0}

Answer = Callable[[int, bool], None]


@dataclass
class _Way:
    """Points to walk to, in the odometry's frame, and the request that waits for the last."""

    number: int
    points: list[Pose]
    until: float


class Walk:
    """The walking half of the motion; `answer(number, arrived)` is called when a way ends."""

    def __init__(self, answer: Answer) -> None:
        self._answer = answer
        self._gait: Gait | None = None
        self._way: _Way | None = None
        self._wish = _STILL  # velocity, when there is no way
        self._fastest = FASTEST
        self._style = Style()
        self._velocity = _STILL  # of the step under way
        self._calm = 0  # steps on the spot
        self._arrived: tuple[int, bool] | None = None  # the way that ends with this stand
        self._waiting: list[int] = []
        self._shoulders: dict[str, float] = {}  # angles that the arms swing about
        self._now = 0.0
        self._swinging = set(_SHOULDERS)
        self.odometry = Odometry()

    @property
    def active(self) -> bool:
        """Whether the legs are led by the walk."""
        return self._gait is not None or self._way is not None or self._wish != _STILL

    @property
    def number(self) -> int:
        """Of the request that waits for the end of the way; 0 when it walks at a velocity."""
        return 0 if self._way is None else self._way.number

    @property
    def stopping(self) -> bool:
        """Whether it comes to stand and shall not go on."""
        return self._gait is not None and self._gait.broken and self._way is None and self._wish == _STILL

    def go(self, number: int, points: Sequence[Sequence[float]], share: float, lift: float) -> None:
        """Walk to poses seen from where the robot is now, at a share of full speed; answers when at the last."""
        poses = [_pose(point) for point in points]
        if not 0 < len(poses) <= MOST_POINTS:
            raise Refused(f"cannot walk along {len(poses)} points: give 1 to {MOST_POINTS}")
        self._leave()
        self._configure(share, lift)
        here, way = self.odometry.pose, 0.0
        for one, other in zip([_STILL, *poses], poses, strict=False):
            gap = relative(one, other)
            if max(map(abs, gap)) > FARTHEST:
                raise Refused(f"cannot walk so far: at most {FARTHEST:g} m from point to point")
            way += sum(abs(part) / limit for part, limit in zip(gap, self._fastest, strict=True))
        self._way = _Way(number, [compose(here, pose) for pose in poses], self._now + _PATIENCE * way + _SLACK)
        if self._gait is None and len(poses) == 1 and _near(relative(_STILL, poses[0]), _THERE):
            self._way = None
            self._answer(number, True)

    def drive(self, velocity: Sequence[float], share: float, lift: float) -> None:
        """Walk at a velocity, as far as the robot can, until told otherwise; zero comes to stand."""
        wish = _pose(velocity)
        self._leave()
        self._configure(share, lift)
        self._wish = _limited(wish, self._fastest)

    def wait(self, number: int) -> None:
        """Answer when the robot does not walk any more."""
        self._waiting.append(number)
        self._tell()

    def stop(self) -> None:
        """Come to stand at once; who waits for a way hears that it was not walked to its end."""
        self._leave()
        if self._gait is not None:
            self._gait.stop()
        self._tell()

    def abandon(self) -> None:
        """Leave the legs to others, as they are."""
        self._leave()
        self._gait = None
        self._tell()

    def swing(self, left: bool, right: bool) -> None:
        """Whether the arms swing, from the next walk on."""
        self._swinging = {name for name, swings in zip(_SHOULDERS, (left, right), strict=True) if swings}

    def velocity(self) -> Pose | None:
        """Ahead, to the left and turning in the step under way; none when the robot does not walk."""
        return self._velocity if self._gait is not None else None

    def planned_pose(self) -> Pose:
        """Where the robot is by the steps that it was told to make, in the odometry's frame."""
        return self.odometry.pose if self._gait is None else self._gait.middle()

    def next_pose(self) -> Pose:
        """Where the robot will be after the step under way, in the odometry's frame."""
        return self.odometry.pose if self._gait is None else self._gait.landing()

    def tick(
        self, period: float, targets: Mapping[str, float], angles: Mapping[str, float], taken: Collection[str]
    ) -> dict[str, float]:
        """Joints for the next period, from where the motors are told to be and what the sensors read. Others have taken some."""
        self._now += period
        if self._gait is None:
            self.odometry.begin(angles)
            self._velocity, self._calm = _STILL, 0
            self._gait = Gait(targets, Stance.of(targets, self.odometry.pose), self._choose, period, self._style)
            self._shoulders = {name: targets[name] for name in _SHOULDERS if name in self._swinging}
        for name in self._shoulders.keys() & taken:
            del self._shoulders[name]  # until the next walk
        gait = self._gait
        self.odometry.follow(gait.support, angles)
        joints = gait.tick(targets)
        if gait.standing:
            self._gait = None
            self._tell()
        return joints | self._arms(gait)

    def _choose(self) -> Pose | None:
        """The velocity of the next step, none to come to stand."""
        wish = self._towards(self._way) if self._way is not None else self._wish
        changes = zip(wish, self._velocity, _CHANGES, strict=True)
        x, y, turning = (min(old + most, max(old - most, new)) for new, old, most in changes)
        # At a goal the last step was short: no need to slow down.
        self._velocity = wish if self._way is not None and wish == _STILL else (x, y, turning)
        self._calm = self._calm + 1 if self._velocity == _STILL else 0
        if self._calm <= _CALM:
            return self._velocity
        self._calm = 0
        if self._way is not None:
            self._arrived = (self._way.number, _near(relative(self.odometry.pose, self._way.points[-1]), _PASSED))
            self._way = None
        return None

    def _towards(self, way: _Way) -> Pose:
        """The velocity to the next point of a way."""
        here = self.odometry.pose
        while len(way.points) > 1 and _near(relative(here, way.points[0]), _PASSED):
            del way.points[0]
        gap = relative(here, way.points[0])
        if self._now > way.until or (len(way.points) == 1 and _near(gap, _THERE)):
            return _STILL
        wish = [part / (2 * self._style.step) for part in gap]
        return _limited(wish, self._fastest)

    def _configure(self, share: float, lift: float) -> None:
        self._fastest = (FASTEST[0] * share, FASTEST[1] * share, FASTEST[2] * share)
        self._style = replace(self._style, lift=lift)

    def _leave(self) -> None:
        """Forget where to walk."""
        self._wish = _STILL
        if self._way is not None:
            self._answer(self._way.number, False)
            self._way = None
        self._tell_arrival()

    def _tell_arrival(self) -> None:
        if self._arrived is not None:
            self._answer(*self._arrived)
            self._arrived = None

    def _tell(self) -> None:
        if self._gait is None:
            self._tell_arrival()
        if not self.active:
            waiting, self._waiting = self._waiting, []
            for number in waiting:
                self._answer(number, True)

    def _arms(self, gait: Gait) -> dict[str, float]:
        """Each arm swings with the other side's foot."""
        ahead = gait.stride() * _SWING
        return {name: clip(name, angle + _SHOULDERS[name] * ahead) for name, angle in self._shoulders.items()}


def ready(targets: Mapping[str, float]) -> None:
    """Refuse to walk with joints from which no step can be made."""
    if not even(targets):
        raise Refused("cannot walk: the soles are not side by side on the floor; take posture StandInit first")


def _pose(values: Sequence[float]) -> Pose:
    x, y, turning = (float(value) for value in values)
    if not all(map(math.isfinite, (x, y, turning))):
        raise Refused("cannot walk: give finite numbers")
    return (x, y, turning)


def _near(gap: Pose, reach: tuple[float, float]) -> bool:
    return math.hypot(gap[0], gap[1]) < reach[0] and abs(gap[2]) < reach[1]


def _limited(wish: Sequence[float], fastest: Pose) -> Pose:
    """A velocity in the wished direction with which all limits together are kept: who turns at full speed walks not at all."""
    effort = max(1.0, sum(abs(part) / limit for part, limit in zip(wish, fastest, strict=True)))
    x, y, turning = (part / effort for part in wish)
    return (x, y, turning)
