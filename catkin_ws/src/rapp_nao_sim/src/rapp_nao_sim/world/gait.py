"""The gait: footsteps for a wished velocity, and the motion of body and feet over them; pure, in a plane of its own; m, rad, s.

The body is a linear inverted pendulum led by its divergent component of motion xi = c + dc/dt / w, the "capture point"
(Englsberger, Ott, Albu-Schaeffer, IEEE T-RO 2015): several steps are laid ahead, and xi follows backwards from the last of them.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from rapp_nao_sim.world import legs
from rapp_nao_sim.world.legs import Array, Placement
from rapp_nao_sim.world.model import CHAINS
from rapp_nao_sim.world.moves import ease
from rapp_nao_sim.world.poses import Pose, between, compose, relative

GRAVITY = 9.81
OTHER = {"L": "R", "R": "L"}
_SIGN = {"L": 1.0, "R": -1.0}
_AHEAD = 5  # steps laid ahead
_PUT_DOWN = 0.06  # s for a lifted foot when the walk is broken off
_BRAKE = 0.16  # s for the body to come to rest then
_SETTLE = 0.5  # s for the body to come to rest between the feet at the end of a walk
_RISING = 1.2  # rad/s of the legs' joints when the body comes to the walk's height
_SWAYING = 0.06  # m/s of the centre of mass meanwhile
_BENT = {"LKneePitch": 0.9, "RKneePitch": 0.9}  # from where straight knees are sure to bend forwards
_ROUNDS = 10
_LEGS = CHAINS["Legs"]


@dataclass(frozen=True)
class Style:
    """How to walk, as found by trial in the physics."""

    step: float = 0.35  # s
    lift: float = 0.02  # m
    height: float = 0.31  # m of the torso's frame above the soles
    apart: float = 0.10  # m between the feet
    double: float = 0.2  # share of a step with both feet on the floor
    ahead: float = 0.02  # m of the centre of pressure before the ankle
    inside: float = 0.004  # m of the centre of pressure towards the other foot
    shift: float = 0.25  # s to shift the weight before the first step


@dataclass(frozen=True)
class Stance:
    """How the body stands before its first step: soles and torso in a plane that the soles lie in."""

    feet: Mapping[str, Pose]
    torso: Placement

    @classmethod
    def of(cls, angles: Mapping[str, float], middle: Pose) -> "Stance":
        """The stance of joints, with the middle of the soles at a pose of the plane."""
        soles = {side: legs.sole(side, angles) for side in legs.SIDES}
        up = _unit(soles["L"].rotation[:, 2] + soles["R"].rotation[:, 2])
        ahead = soles["L"].rotation[:, 0] + soles["R"].rotation[:, 0]
        ahead = _unit(ahead - up * (ahead @ up))
        plane = np.column_stack([ahead, np.cross(up, ahead), up])  # in the torso's frame
        centre = (soles["L"].position + soles["R"].position) / 2
        feet = {}
        for side, (rotation, position) in soles.items():
            x, y, _ = plane.T @ (position - centre)
            heading = plane.T @ rotation[:, 0]
            feet[side] = compose(middle, (float(x), float(y), math.atan2(heading[1], heading[0])))
        turned = legs.about_z(middle[2])
        place = turned @ (plane.T @ -centre) + (middle[0], middle[1], 0.0)
        return cls(feet, Placement(turned @ plane.T, place))


def even(angles: Mapping[str, float]) -> bool:
    """Whether both soles lie in one plane and apart, so that a walk can begin."""
    left, right = (legs.sole(side, angles) for side in legs.SIDES)
    gap = left.position - right.position
    up = _unit(left.rotation[:, 2] + right.rotation[:, 2])
    tilted = math.acos(min(1.0, float(left.rotation[:, 2] @ right.rotation[:, 2]))) > 0.06
    return not tilted and abs(float(gap @ up)) < 0.01 and float(gap[1]) > 0.06


class Gait:
    """Walks from a stance; each `tick` gives the legs' angles a period later, until `standing`.

    `wish` is asked at the beginning of each step for a velocity (ahead, to the left, turning), or None to come to stand.
    """

    def __init__(
        self, angles: Mapping[str, float], stance: Stance, wish: Callable[[], Pose | None], period: float, style: Style
    ) -> None:
        self._style = style
        self._wish = wish
        self._period = period
        self.feet: dict[str, Pose] = dict(stance.feet)
        self._goals = self.feet  # after the step under way
        self.support = "R"
        self.standing = False
        self.broken = False
        self._angles = dict(angles)
        self._torso = stance.torso
        self._centre = legs.centre_of_mass(angles)  # in the torso's frame
        self._w = math.sqrt(GRAVITY / (style.height + float(self._centre[2])))
        self._c: Array = (stance.torso.position + stance.torso.rotation @ self._centre)[:2]
        self._xi = self._c.copy()
        self._raised: dict[str, float] = dict.fromkeys(legs.SIDES, 0.0)  # m of the soles above the floor
        self._motion = self._walk()

    def tick(self, body: Mapping[str, float]) -> dict[str, float]:
        """The legs' angles after the next period, with the other joints where `body` has them."""
        self._angles.update(body)
        placed = next(self._motion, None)
        if placed:
            self._angles.update(self._reach(self._angles, 3))
            # Half of the way: the place of the torso depends on it, and would swing.
            self._centre = (self._centre + legs.centre_of_mass(self._angles)) / 2
        self.standing = placed is None
        return {name: self._angles[name] for name in _LEGS}

    def stop(self) -> None:
        """Come to stand at once: put the lifted foot down and brake."""
        self.broken = True

    def middle(self) -> Pose:
        """Between the feet."""
        return between(self.feet["L"], self.feet["R"], 0.5)

    def landing(self) -> Pose:
        """Between the feet after the step under way."""
        return between(self._goals["L"], self._goals["R"], 0.5)

    def stride(self) -> float:
        """How far the right foot is ahead of the left, m."""
        return relative(self.feet["L"], self.feet["R"])[0]

    def _walk(self) -> Iterator[bool]:
        """The walk period by period; gives whether the legs are led by the places of torso and feet."""
        yield from self._rise()
        if self.broken:
            return  # both soles are on the floor, and nothing swings yet: the robot stays as far as it has come
        yield from self._shift()
        while not self.broken:
            velocity = self._wish()
            if velocity is None:
                yield from self._halt(_SETTLE, self._balance())
                return
            yield from self._step(velocity)
        rest = self._c + self._w * (self._xi - self._c) * _BRAKE / 2  # so that it brakes evenly
        yield from self._halt(_BRAKE, rest)

    def _rise(self) -> Iterator[bool]:
        """Come upright to the walk's height, the weight between the feet, by the shortest way of the joints."""
        start, before = dict(self._angles), self._c
        for _ in range(_ROUNDS):  # the centre of mass moves with the legs
            self._c = self._balance()
            self._stand()
            goal = self._reach(start | _BENT, _ROUNDS)
            self._centre = legs.centre_of_mass(start | goal)
        self._xi = self._c.copy()
        joints = max(abs(goal[name] - start[name]) for name in goal) / _RISING
        ticks = math.ceil(max(joints, float(np.linalg.norm(self._c - before)) / _SWAYING) / self._period)
        for tick in range(1, ticks + 1):
            if self.broken:
                return
            share = ease(tick / ticks)
            self._angles.update((name, start[name] + (angle - start[name]) * share) for name, angle in goal.items())
            yield False

    def _shift(self) -> Iterator[bool]:
        """Swing the body so that the first step can begin; the pressure stays where it drives xi there."""
        time = self._style.shift
        growth = math.exp(self._w * time)
        pressure = (self._entry((0.0, 0.0, 0.0)) - growth * self._xi) / (1 - growth)
        for _ in range(round(time / self._period)):
            if self.broken:
                return
            self._fall(pressure)
            self._stand()
            yield True

    def _step(self, velocity: Pose) -> Iterator[bool]:
        """One step."""
        style, swing = self._style, OTHER[self.support]
        start, goal = self.feet[swing], self._next(self.support, self.feet[self.support], velocity)
        self._goals = {swing: goal, self.support: self.feet[self.support]}
        pressure, target = self._pressure(self.support, self.feet[self.support]), self._exit(velocity)
        ticks = round(style.step / self._period)
        for tick in range(1, ticks + 1):
            if self.broken:
                return
            self._xi = pressure + math.exp(self._w * (tick - ticks) * self._period) * (target - pressure)
            self._c = self._c + self._period * self._w * (self._xi - self._c)
            share = min(1.0, max(0.0, (tick / ticks - style.double / 2) / (1 - style.double)))
            smooth = share**3 * (10 - 15 * share + 6 * share * share)
            self.feet[swing] = between(start, goal, smooth)
            self._raised[swing] = style.lift * math.sin(math.pi * share) ** 2
            self._stand()
            yield True
        self._raised[swing] = 0.0
        self.support = swing

    def _halt(self, time: float, goal: Array) -> Iterator[bool]:
        """Bring the body from its velocity to rest at a place; a lifted foot comes down."""
        start, speed, raised = self._c.copy(), self._w * (self._xi - self._c), dict(self._raised)
        ticks = round(time / self._period)
        for tick in range(1, ticks + 1):
            share = tick / ticks
            smooth = ease(share)
            self._c = start + (goal - start) * smooth + speed * time * share * (1 - share) ** 2
            down = 1 - ease(min(1.0, tick * self._period / _PUT_DOWN))
            self._raised = {side: height * down for side, height in raised.items()}
            self._stand()
            yield True
        self._xi = self._c.copy()
        self._goals = self.feet

    def _reach(self, angles: Mapping[str, float], rounds: int) -> dict[str, float]:
        """The legs' angles for the places of torso and feet."""
        rotation, position = self._torso
        places = {}
        for side, (x, y, heading) in self.feet.items():
            at = np.array([x, y, self._raised[side]]) - position
            places[side] = Placement(rotation.T @ legs.about_z(heading), rotation.T @ at)
        return legs.reach(angles, places["L"], places["R"], rounds)

    def _fall(self, pressure: Array) -> None:
        """Let the pendulum go on for a period."""
        self._xi = pressure + math.exp(self._w * self._period) * (self._xi - pressure)
        self._c = self._c + self._period * self._w * (self._xi - self._c)

    def _stand(self) -> None:
        """Put the upright torso where the centre of mass is to be."""
        rotation = legs.about_z(self.middle()[2])
        x, y = self._c - (rotation @ self._centre)[:2]
        self._torso = Placement(rotation, np.array([x, y, self._style.height]))

    def _balance(self) -> Array:
        """Where the centre of mass rests between the feet."""
        half: Array = (self._pressure("L", self.feet["L"]) + self._pressure("R", self.feet["R"])) / 2
        return half

    def _pressure(self, side: str, foot: Pose) -> Array:
        """Where a foot is to be pressed."""
        x, y, _ = compose(foot, (self._style.ahead, -_SIGN[side] * self._style.inside, 0.0))
        return np.array([x, y])

    def _next(self, support: str, foot: Pose, velocity: Pose) -> Pose:
        """Where the other foot goes from a support foot."""
        sign, apart = _SIGN[OTHER[support]], self._style.apart
        ahead, aside, turned = (part * self._style.step for part in velocity)
        # Sideways and turning go with the foot on that side, twice as far; the other closes up.
        aside, turned = (2 * part if part * sign > 0 else 0.0 for part in (aside, turned))
        middle = compose(foot, (0.0, sign * apart / 2, turned))
        return compose(middle, (ahead * math.cos(turned), sign * apart / 2 + aside - ahead * math.sin(turned), 0.0))

    def _exit(self, velocity: Pose) -> Array:
        """Where xi is to be at the end of a step that begins now, by the steps that follow it."""
        feet, support, pressures = dict(self.feet), self.support, []
        for _ in range(_AHEAD):
            swing = OTHER[support]
            feet[swing] = self._next(support, feet[support], velocity)
            pressures.append(self._pressure(swing, feet[swing]))
            support = swing
        xi = self._balance() if not pressures else pressures[-1]
        for pressure in reversed(pressures):
            xi = pressure + math.exp(-self._w * self._style.step) * (xi - pressure)
        return np.asarray(xi)

    def _entry(self, velocity: Pose) -> Array:
        """Where xi is to be at the beginning of a step."""
        pressure = self._pressure(self.support, self.feet[self.support])
        entry: Array = pressure + math.exp(-self._w * self._style.step) * (self._exit(velocity) - pressure)
        return entry


def _unit(vector: Array) -> Array:
    unit: Array = vector / np.linalg.norm(vector)
    return unit
