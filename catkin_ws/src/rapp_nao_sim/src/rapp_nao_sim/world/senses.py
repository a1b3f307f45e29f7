"""What the body feels, and the events that this makes: told to whoever listens, in their order."""

from collections import deque
from collections.abc import Callable
from typing import Any

from rapp_nao_sim.world import feet
from rapp_nao_sim.world.body import Body
from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.falls import Falls
from rapp_nao_sim.world.keys import TOUCHES, Feelings
from rapp_nao_sim.world.legs import SIDES
from rapp_nao_sim.world.model import BODY, JOINTS
from rapp_nao_sim.world.motion import Motion
from rapp_nao_sim.world.sonar import Sonar

LONGEST_TOUCH = 600.0  # s
_FEEL = 0.025  # s between two looks at feet and tilt
_PING = 0.1  # s between two measures of the sonars
_SLOW = 1.0  # s between two looks at battery and heat, and the longest silence towards a listener
_HOLD = 0.1  # s that a bumper stays pressed after a contact, and that feet lose the floor before it is told: they bounce
_LIGHT = 0.5  # kg on both feet that still are a contact with the floor
_KEPT = 1000  # events that wait for a listener
_USE = {True: 1 / 5400, False: 1 / 14400}  # share of the battery per s, awake and at rest
_ROOM_HEAT, _STIFF_HEAT, _LOAD_HEAT = 27.0, 11.0, 20.0  # degrees C of a motor: at rest, more when stiff, more at full load
_WARMING = 1 / 240  # per s

Event = tuple[str, Any]


class Senses:
    """Looks at the body as time passes; `answer(number, events)` answers who listens."""

    def __init__(self, bullet: Any, body: Body, motion: Motion, answer: Callable[[int, Any], None]) -> None:
        self._bullet = bullet
        self._body = body
        self._motion = motion
        self._answer = answer
        self._sonar = Sonar(bullet, body)
        self._falls = Falls()
        self._now = 0.0
        self._due = {"feel": 0.0, "ping": 0.0, "slow": 0.0}
        self._pinging = False
        self._guarding = {"bumpers": True, "falls": True}
        self._events: deque[Event] = deque(maxlen=_KEPT)
        self._listener: int | None = None
        self._told = 0.0  # when the listener was told something
        self._touched: dict[str, float] = {}  # places, until when
        self._pressed: frozenset[str] = frozenset()
        self._sounded: dict[str, bool] = {}  # events of the sonars that hold
        self._grounded = True  # whether a foot carries the robot
        self._changed = 0.0  # when this was last seen
        self._charge = 1.0
        self._heat = dict.fromkeys(BODY, _ROOM_HEAT + _STIFF_HEAT)

    def commands(self) -> dict[str, Callable[..., Any]]:
        """What the line's other end may ask for; "events" is answered later."""
        return {
            "feelings": self.feelings,
            "touch": self.touch,
            "set_charge": self.set_charge,
            "set_sonar": self.set_sonar,
            "guard": self.guard,
        }

    def tick(self, seconds: float) -> None:
        """Let time pass."""
        self._now += seconds
        if self._pass("feel", _FEEL):
            self._feel_feet()
            self._feel_touches()
            self._feel_fall()
        if self._pinging and self._pass("ping", _PING):
            self._sonar.measure()
            self._tell_sonar()
        if self._pass("slow", _SLOW):
            self._use_up(_SLOW)
        self._tell()

    def listen(self, number: int) -> None:
        """Answer a request with the events that come, at the latest with none after a while; the older listener gets none."""
        if self._listener is not None:
            self._answer(self._listener, [])
        self._listener, self._told = number, self._now
        self._tell()

    def touch(self, name: str, seconds: float) -> None:
        """A hand on a sensor for a time."""
        if name not in TOUCHES:
            raise Refused(f"cannot touch {name!r}: known are {', '.join(TOUCHES)}")
        if not 0 < seconds <= LONGEST_TOUCH:
            raise Refused(f"cannot touch for {seconds:g} s: give more than 0, at most {LONGEST_TOUCH:g}")
        for place in TOUCHES[name][0]:
            self._touched[place] = self._now + seconds

    def set_charge(self, charge: float) -> None:
        """The battery's charge, 0 to 1."""
        if not 0 <= charge <= 1:
            raise Refused("cannot set the battery: its charge is from 0 to 1")
        self._set_charge(charge)

    def set_sonar(self, on: bool) -> None:
        """Whether the sonars measure."""
        if on and not self._pinging:
            self._sonar.measure()
        self._pinging = on

    def guard(self, what: str, on: bool) -> None:
        """Whether "bumpers" stop the walk, and "falls" take the stiffness away."""
        if what not in self._guarding:
            raise Refused(f"cannot guard {what!r}: known are {', '.join(self._guarding)}")
        self._guarding[what] = on

    def feelings(self) -> Feelings:
        """Everything that is felt now."""
        pitch, roll = self._body.lean()
        turning, pull = self._body.inertia()
        return Feelings(
            angles=self._body.angles(),
            targets=dict(self._motion.targets),
            stiffness=dict(self._motion.stiffness),
            heat=dict(self._heat),
            tilt=(roll, pitch, self._body.heading()),
            turning=turning,
            pull=pull,
            feet={side: feet.weights(side, feet.contacts(self._bullet, self._body, side)) for side in SIDES},
            pressed=self._pressed | self._touched.keys(),
            charge=self._charge,
            echoes=dict(self._sonar.echoes),
        )

    def _pass(self, what: str, period: float) -> bool:
        if self._now < self._due[what]:
            return False
        self._due[what] = self._now + period
        return True

    def _raise(self, key: str, value: Any) -> None:
        self._events.append((key, value))

    def _tell(self) -> None:
        if self._listener is not None and (self._events or self._now - self._told > _SLOW):
            number, self._listener = self._listener, None
            events = list(self._events)
            self._events.clear()
            self._answer(number, events)

    def _feel_feet(self) -> None:
        found = {side: feet.contacts(self._bullet, self._body, side) for side in SIDES}
        for side, contacts in found.items():
            for place in feet.bumped(side, contacts):
                self._touched[place] = max(self._touched.get(place, 0.0), self._now + _HOLD)
        grounded = sum(sum(feet.weights(side, contacts)) for side, contacts in found.items()) > _LIGHT
        if grounded == self._grounded:
            self._changed = self._now
        elif self._now - self._changed > _HOLD:
            self._grounded = grounded
            self._raise("footContactChanged", grounded)

    def _feel_touches(self) -> None:
        before = self._pressed
        self._pressed = frozenset(place for place, until in self._touched.items() if until > self._now)
        self._touched = {place: self._touched[place] for place in self._pressed}
        changed = sorted(before ^ self._pressed)
        for places, event in TOUCHES.values():
            pressed = not self._pressed.isdisjoint(places)
            if pressed == before.isdisjoint(places):
                self._raise(event, float(pressed))
        if changed:
            self._raise("TouchChanged", [[place, place in self._pressed] for place in changed])
        self._mind_bumpers(new=any("Bumper" in place for place in self._pressed - before))

    def _mind_bumpers(self, new: bool) -> None:
        """Stop a walk that goes against something."""
        walk = self._motion.walk
        velocity = walk.velocity()
        pressed = any("Bumper" in place for place in self._pressed)
        if not self._guarding["bumpers"] or velocity is None or not any(velocity) or walk.stopping:
            return
        if (velocity[0] > 0 and pressed) or (velocity[0] == 0 and new):
            walk.stop()
            x, y, _ = walk.odometry.pose
            self._raise("ALMotion/MoveFailed", ["obstacle", 1, [x, y]])

    def _feel_fall(self) -> None:
        if self._motion.changing:
            return
        standing = self._body.hips() > 0.13
        match self._falls.watch(self._now, self._body.tilt(), standing, self._body.still()):
            case "falling":
                self._raise("robotIsFalling", True)
                if self._guarding["falls"]:
                    self._motion.collapse()
            case "fallen":
                self._raise("robotHasFallen", True)

    def _tell_sonar(self) -> None:
        near = {side: self._sonar.near(side) for side in ("Left", "Right")}
        for side, distance in near.items():
            for event, holds in ((f"Sonar{side}Detected", distance is not None), (f"Sonar{side}NothingDetected", distance is None)):
                if holds and not self._sounded.get(event):
                    self._raise(event, self._sonar.echoes[side][0])
                self._sounded[event] = holds

    def _use_up(self, seconds: float) -> None:
        """Drain the battery, warm the motors."""
        self._set_charge(max(0.0, self._charge - seconds * _USE[self._motion.awake()]))
        loads = self._body.loads()
        for name in BODY:
            load = min(1.0, abs(loads[name]) / JOINTS[name].torque)
            goal = _ROOM_HEAT + _STIFF_HEAT * self._motion.stiffness[name] + _LOAD_HEAT * load * self._motion.stiffness[name]
            self._heat[name] += (goal - self._heat[name]) * seconds * _WARMING

    def _set_charge(self, charge: float) -> None:
        before, self._charge = round(self._charge * 100), charge
        if round(charge * 100) != before:
            self._raise("BatteryChargeChanged", round(charge * 100))
