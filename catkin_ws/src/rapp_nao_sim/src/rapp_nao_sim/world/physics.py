"""The physics process: the room and the robot, stepped in real time, commanded over its line.

Started by WorldClient as `python -m rapp_nao_sim.world.physics FD`.
"""

import logging
import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rapp_nao_sim.world import postures, room
from rapp_nao_sim.world.body import Body
from rapp_nao_sim.world.bullet import connect
from rapp_nao_sim.world.errors import Invalid, Refused
from rapp_nao_sim.world.furnishing import Furnishing
from rapp_nao_sim.world.motion import Motion
from rapp_nao_sim.world.senses import Senses
from rapp_nao_sim.world.touching import Touching
from rapp_nao_sim.world.worker import WAIT, Service, serve

STEP = 1 / 240  # s of one step of the physics
STEPS = 3  # per tick
TICK = STEP * STEPS
ASLEEP = 160  # ticks without any change, after which the physics rests until something happens
LATEST = 0.25  # s behind the clock, after which lost time is given up
FALLEN = 0.8  # rad the torso leans more than in any posture on feet or seat
LONGEST_PUSH = 60.0  # s

_log = logging.getLogger(__name__)


class Physics:
    """The simulated world."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._bullet = connect()
        self._still = 0  # ticks since anything happened
        self._clock = 0.0  # s simulated
        self._pushes: list[tuple[tuple[float, float, float], float]] = []
        service.offer({"set_up": self._set_up})

    def _set_up(self, file: Path | None, posture: str | None, pace: float) -> room.Room:
        self._period = TICK / pace if pace else 0.0
        plan = room.load(file or room.FILE)
        known = postures.load()
        start = plan.robot
        bullet = self._bullet
        bullet.setGravity(0, 0, -9.81)
        bullet.setTimeStep(STEP)
        name = posture or start.posture
        if name not in known:
            raise Invalid(f"cannot start in posture {name!r}: known are {', '.join(known)}; correct [robot] of the room file")
        self._body = Body(bullet, looks=False)
        self._furnishing = Furnishing(bullet, plan, self._body.touches, self._wake)
        self._motion = Motion(bullet, self._body, known, self._service.answer)
        self._motion.begin(name, (start.x, start.y), start.theta)
        self._plan = plan
        self._senses = Senses(bullet, self._body, self._motion, self._service.answer)
        self._touching = Touching(self._body, self._furnishing.names)
        self._service.offer(self._commands())
        return plan

    def _commands(self) -> dict[str, Callable[..., Any]]:
        body, motion = self._body, self._motion

        def later(command: Callable[..., None]) -> Callable[..., Any]:
            def begin(*args: Any) -> Any:
                command(self._service.number, *args)
                return WAIT

            return begin

        return {
            "robot_pose": body.pose,
            "link": body.matrix,
            "clock": lambda: self._clock,
            "velocity": motion.velocity,
            "joint_angles": lambda names: _pick(body.angles(), names),
            "commanded_angles": lambda names: _pick(motion.targets, names),
            "stiffnesses": lambda names: _pick(motion.stiffness, names),
            "set_stiffness": motion.set_stiffness,
            "set_joints": motion.set_joints,
            "move_joints": later(motion.move_joints),
            "set_posture": later(motion.set_posture),
            "posture": motion.posture,
            "wake_up": later(motion.wake_up),
            "rest": later(motion.rest),
            "walk_to": later(motion.walk_to),
            "walk_at": motion.walk_at,
            "walking": lambda: motion.walk.active,
            "wait_for_walk": later(motion.walk.wait),
            "stop_walk": motion.walk.stop,
            "swing_arms": motion.walk.swing,
            "planned_pose": motion.walk.planned_pose,
            "busy": motion.busy,
            "tasks": motion.tasks,
            "protect": motion.protect,
            "odometry": lambda: motion.walk.odometry.pose,
            "stance": motion.stance,
            "next_pose": motion.walk.next_pose,
            "stop": motion.stop,
            "stop_joints": motion.stop_joints,
            "stop_posture": motion.stop_posture,
            "is_moving": motion.moving,
            "awake": motion.awake,
            "fallen": self._fallen,
            "push": self._push,
            "take_touched": self._touching.take,
            "load_room": self._load_room,
            "start_at": self._start_at,
            "snapshot": self._snapshot,
            "events": later(self._senses.listen),
            **self._senses.commands(),
            **self._furnishing.commands(),
        }

    def run(self) -> None:
        """Wait to be set up, then step and answer until the parent leaves."""
        while not hasattr(self, "_motion"):
            self._service.pending(None)
            self._service.handle()
        due = time.monotonic()
        while True:
            self._tick()
            due = due + self._period if self._period else time.monotonic()
            late = time.monotonic() - due
            if late > LATEST:
                _log.warning("the physics is %.2f s late: that time is given up", late)
                due += late
            while self._service.pending(max(0.0, due - time.monotonic())):
                self._service.handle()
                if time.monotonic() >= due:
                    break

    def _tick(self) -> None:
        self._clock += TICK
        self._step()
        self._senses.tick(TICK)

    def _step(self) -> None:
        if not self._motion.tick(TICK):
            self._still = 0
            return
        self._still = self._still + 1 if self._motion.quiet and not self._pushes and self._body.still() else 0
        if self._still > ASLEEP:
            return
        for _ in range(STEPS):
            for force, _ in self._pushes:
                self._body.push(force)
            self._pushes = [(force, left - STEP) for force, left in self._pushes if left > STEP]
            self._bullet.stepSimulation()
        self._touching.tick()
        self._body.sense(TICK)

    def _fallen(self) -> bool:
        pitch, roll = self._body.lean()
        name, _ = self._motion.posture()
        return name == "Unknown" and max(abs(pitch), abs(roll)) > FALLEN and not self._motion.moving()

    def _push(self, force: Sequence[float], seconds: float) -> None:
        x, y, z = (float(part) for part in force)
        if not all(map(math.isfinite, (x, y, z))) or not 0 < seconds <= LONGEST_PUSH:
            raise Refused(f"cannot push: give finite newtons and more than 0, at most {LONGEST_PUSH:g} s")
        self._pushes.append(((x, y, z), seconds))

    def _load_room(self, file: Path) -> room.Room:
        plan = room.load(file)
        start = plan.robot
        if start.posture not in postures.load():
            raise Invalid(f"cannot start in posture {start.posture!r}: known are {', '.join(postures.load())}")
        self._motion.stop()
        self._furnishing.furnish(plan)
        self._motion.begin(start.posture, (start.x, start.y), start.theta)
        self._plan = plan
        return plan

    def _start_at(self, name: str) -> None:
        places = {place.name: place for place in self._plan.starts}
        if name not in places:
            raise Refused(f"cannot start at {name!r}: the room's places are {', '.join(places) or 'none'}")
        place = places[name]
        self._motion.stop()
        self._motion.begin(self._plan.robot.posture, (place.x, place.y), place.theta)
        self._wake()

    def _wake(self) -> None:
        """Let the physics go on after a change."""
        self._still = 0

    def _snapshot(self) -> dict[str, Any]:
        position, orientation = self._body.base()
        return {
            "angles": self._body.angles(),
            "position": position,
            "orientation": orientation,
        } | self._furnishing.state()


def _pick(values: dict[str, float], names: Sequence[str]) -> list[float]:
    unknown = [name for name in names if name not in values]
    if unknown:
        raise Refused(f"cannot find joint {unknown[0]!r}: known are {', '.join(values)}")
    return [values[name] for name in names]


if __name__ == "__main__":
    serve(lambda service: Physics(service).run, sys.argv)
