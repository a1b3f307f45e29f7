"""Moves the body: joints on tracks by their motors, walking, changes of posture kinematically, stiffness.

A change of posture sets joints and torso along a way that always rests on the floor and hands over to the physics at its end;
meanwhile joints that are commanded one by one follow their own tracks.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from rapp_nao_sim.world.body import Body
from rapp_nao_sim.world.change import Change, upright
from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.frames import Stance
from rapp_nao_sim.world.model import BODY, CHAINS
from rapp_nao_sim.world.moves import check, clip, direct, posture_time, through, twin
from rapp_nao_sim.world.postures import LEAN_TOLERANCE, Posture, family, recognise
from rapp_nao_sim.world.selfcollision import HELD, held
from rapp_nao_sim.world.tracks import Answer, Tracks
from rapp_nao_sim.world.walk import Walk, ready

_SETTLE = 0.3  # s of physics after a change, before it is judged
_CALM = 0.8  # speed of waking up and resting
_SLIP = 0.01  # rad that a limp joint gives before its gears slip
Ways = Sequence[Sequence[float]]  # for each joint, its values one after another


class Motion:
    """Commands to the body; `answer(number, reached)` is called when a command that takes time ends."""

    def __init__(self, bullet: Any, body: Body, postures: Mapping[str, Posture], answer: Answer) -> None:
        self._bullet = bullet
        self._body = body
        self._postures = postures
        self._answer = answer
        self._now = 0.0
        self._tracks = Tracks(answer)
        self._change: Change | None = None
        self._moved = True
        self.walk = Walk(answer)
        self.protected = HELD  # chains that are kept out of the body
        self.quiet = False  # nothing was commanded, and no limp joint gave way, in the last tick
        self.targets = body.angles()
        self.stiffness = dict.fromkeys(BODY, 1.0)

    def begin(self, name: str, feet: tuple[float, float], theta: float) -> None:
        """Put the robot in a posture at a place, at once."""
        posture = self._posture(name)
        self.walk.abandon()
        self._body.put(posture.angles, upright(self._bullet, theta, posture.pitch), feet)
        self.targets = dict(posture.angles)
        self._moved = True

    def tick(self, seconds: float) -> bool:
        """Let time pass; gives whether the physics shall step (not while the posture changes)."""
        self._now += seconds
        self._follow()
        if self._change is not None and self._now < self._change.end:
            self._transform(self._change)
            return False
        if self._change is not None and self._now >= self._change.end + _SETTLE:
            self._finish(self._change)
        self._slip()
        if self.walk.active:
            self.targets.update(self.walk.tick(seconds, self.targets, self._body.angles(), self._tracks))
            self._moved = True
        self.quiet = not self._moved and not self.moving()
        if self._moved:
            self._body.drive(self.targets, self.stiffness)
            self._moved = False
        return True

    def set_joints(self, names: Sequence[str], angles: Sequence[float], fraction: float) -> None:
        """Send joints to angles at a fraction (0 to 1) of their greatest speed."""
        if not 0 < fraction <= 1:
            raise Refused(f"cannot move at {fraction:g} of the greatest speed; give more than 0 and at most 1")
        check(names, angles)
        self._spare(names)
        for name, angle in zip(names, angles, strict=True):
            for joint in (name, *twin(name)):
                self._tracks.lead(joint, direct(joint, self._now, self.targets[joint], clip(joint, angle), fraction))

    def move_joints(self, number: int, names: Sequence[str], goals: Ways, times: Ways) -> None:
        """Send joints through angles at times (s from now, rising); answers at the end, false when something stopped them."""
        check(names, goals, times)
        for name, way, when in zip(names, goals, times, strict=True):
            if not way or len(way) != len(when) or any(b <= a for a, b in zip((0.0, *when), when, strict=False)):
                raise Refused(f"cannot move {name}: it needs as many rising times above 0 as angles")
        self._spare(names)
        joints: set[str] = set()
        for name, way, when in zip(names, goals, times, strict=True):
            for joint in (name, *twin(name)):
                self._tracks.lead(joint, through(self._now, self.targets[joint], [clip(joint, angle) for angle in way], when))
                joints.add(joint)
        self._tracks.expect(number, joints)

    def set_posture(self, number: int, name: str, speed: float, release: bool = False) -> None:
        """Take a posture; answers at the end whether it is reached."""
        posture = self._posture(name)
        if not 0 < speed <= 1:
            raise Refused(f"cannot take a posture at speed {speed:g}; give more than 0 and at most 1")
        if not self.awake():
            raise Refused("cannot take a posture: the legs have no stiffness; wake the robot up first")
        self.stop()
        self.walk.abandon()
        pitch, roll = self._body.lean()
        start, (_, orientation) = self._body.angles(), self._body.base()
        time = posture_time(start, dict(posture.angles), abs(pitch - posture.pitch) + abs(roll), speed)
        x, y, theta = self._body.pose()
        way = (orientation, upright(self._bullet, theta, posture.pitch))
        self._change = Change(number, posture, self._now, self._now + time, start, way, (x, y), release)

    def walk_to(self, number: int, points: Ways, share: float, lift: float) -> None:
        """Walk to poses seen from where the robot is; answers at the end, false when something stopped it."""
        self._ready_to_walk()
        self.walk.go(number, points, share, lift)

    def walk_at(self, velocity: Sequence[float], share: float, lift: float) -> None:
        """Walk at a velocity until told otherwise."""
        if any(velocity):
            self._ready_to_walk()
        self.walk.drive(velocity, share, lift)

    def wake_up(self, number: int) -> None:
        """Stiffen all joints; a robot that is on its feet stands up."""
        asleep = not self.awake()
        self.set_stiffness(BODY, [1.0] * len(BODY))
        if asleep and self.posture()[1] == "Standing":
            self.set_posture(number, "StandInit", _CALM)
        else:
            self._answer(number, True)

    def rest(self, number: int) -> None:
        """Go to a resting posture (crouched, or as it sits or lies) and remove the stiffness."""
        if self.awake() and self.posture()[1] == "Standing":
            self.set_posture(number, "Crouch", _CALM, release=True)
        else:
            self.stop()
            self.set_stiffness(BODY, [0.0] * len(BODY))
            self._answer(number, True)

    def set_stiffness(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Share of the motors' torque, 0 to 1."""
        check(names, values)
        actual = self._body.angles()
        for name, value in zip(names, values, strict=True):
            for joint in (name, *twin(name)):
                if self.stiffness[joint] == 0:  # it may have sunk: it stiffens where it is
                    self.targets[joint] = actual[joint]
                self.stiffness[joint] = min(1.0, max(0.0, float(value)))
        self._moved = True

    def stop(self) -> None:
        """End all movement; who waits for it hears false. A walking robot comes to stand."""
        self.stop_joints(BODY)
        self.stop_posture()
        self.walk.stop()

    def stop_joints(self, names: Sequence[str]) -> None:
        """End the movement of joints here."""
        check(names)
        for name in names:
            self._tracks.stop(name)

    def stop_posture(self) -> None:
        """End a change of posture here."""
        change, self._change = self._change, None
        if change is not None:
            self._moved = True
            self._answer(change.number, False)

    def protect(self, side: str, on: bool) -> None:
        """Whether an arm ("L" or "R") is kept out of the body."""
        self.protected = self.protected | {f"{side}Arm"} if on else self.protected - {f"{side}Arm"}

    def collapse(self) -> None:
        """End all movement and remove the stiffness at once."""
        self.stop()
        self.walk.abandon()
        self.set_stiffness(BODY, [0.0] * len(BODY))

    @property
    def changing(self) -> bool:
        """Whether a change of posture is under way."""
        return self._change is not None

    def moving(self) -> bool:
        """Whether a command is under way."""
        return bool(self._tracks) or self._change is not None or self.walk.active

    def busy(self, names: Sequence[str]) -> bool:
        """Whether a command moves any of these joints."""
        check(names)
        walking = self.walk.active and any(name in CHAINS["Legs"] for name in names)
        return self._change is not None or walking or any(name in self._tracks for name in names)

    def tasks(self) -> list[tuple[str, int, list[str]]]:
        """What is under way: what it is, the number of the request that waits for its end, the joints it moves."""
        found = [("angleInterpolation", number, sorted(joints, key=BODY.index)) for number, joints in self._tracks.expected()]
        if self._change is not None:
            found.append(("goToPosture", self._change.number, list(BODY)))
        return [*found, ("move", self.walk.number, CHAINS["Legs"])] if self.walk.active else found

    def velocity(self) -> tuple[float, float, float]:
        """Ahead, to the left (m/s) and turning (rad/s): of the step under way, or of the torso when it does not walk."""
        return self.walk.velocity() or self._body.velocity()

    def stance(self, use_sensors: bool) -> Stance:
        """What tells where the body's parts are."""
        angles, pose = (self._body.angles(), self.walk.odometry.pose) if use_sensors else (self.targets, self.walk.planned_pose())
        return Stance(angles, self._body.up(), pose)

    def awake(self) -> bool:
        """Whether the legs have stiffness."""
        return all(self.stiffness[name] > 0 for name in CHAINS["Legs"])

    def posture(self) -> tuple[str, str]:
        """Name and family of what the body is in; the name is "Unknown" in between."""
        pitch, roll = self._body.lean()
        name = recognise(self._postures, self._body.angles(), pitch, roll)
        if name != "Unknown":
            return name, self._postures[name].family
        return name, family(pitch, roll, self._body.hips())

    def _follow(self) -> None:
        wanted = {name: angle for name, angle in self._tracks.angles(self._now).items() if self.stiffness[name] > 0}
        for chain in self.protected:
            moved = wanted.keys() & CHAINS[chain]
            if moved and self._change is None and held(chain, self.targets, self.targets | wanted):
                wanted = {name: angle for name, angle in wanted.items() if name not in moved}
        self._moved = self._moved or bool(wanted)
        self.targets.update(wanted)
        self._tracks.arrive(self._now)

    def _slip(self) -> None:
        """Let limp joints give way: dry friction holds them where they are until the load drags them on."""
        limp = [name for name in BODY if self.stiffness[name] == 0]
        if not limp:
            return
        actual = self._body.angles()
        for name in limp:
            held = min(actual[name] + _SLIP, max(actual[name] - _SLIP, self.targets[name]))
            if held != self.targets[name]:
                self.targets[name] = held
                self._moved = True

    def _spare(self, names: Sequence[str]) -> None:
        """Refuse joints that the walk needs."""
        needed = [name for name in names if name in CHAINS["Legs"]] if self.walk.active else []
        if needed:
            raise Refused(f"cannot move {needed[0]}: the robot walks on it; stop the walk first")

    def _ready_to_walk(self) -> None:
        if not self.awake():
            raise Refused("cannot walk: the legs have no stiffness; wake the robot up first")
        if self._change is not None:
            raise Refused("cannot walk: the posture is changing; wait for its end")
        if self.walk.active:
            return
        group = self.posture()[1]
        if group != "Standing":
            raise Refused(f"cannot walk: the robot is {group.lower()}; take posture Stand first")
        ready(self.targets)
        self.stop_joints(CHAINS["Legs"])

    def _transform(self, change: Change) -> None:
        angles, orientation = change.at(self._now, self._bullet)
        self.targets.update((name, angle) for name, angle in angles.items() if name not in self._tracks)
        self._body.put(self.targets, orientation, change.feet)
        self._moved = True

    def _finish(self, change: Change) -> None:
        self._change = None
        pitch, roll = self._body.lean()
        if change.release:
            self.set_stiffness(BODY, [0.0] * len(BODY))
        self._answer(change.number, max(abs(pitch - change.posture.pitch), abs(roll)) < LEAN_TOLERANCE)

    def _posture(self, name: str) -> Posture:
        if name not in self._postures:
            raise Refused(f"cannot take posture {name!r}: known are {', '.join(self._postures)}")
        return self._postures[name]
