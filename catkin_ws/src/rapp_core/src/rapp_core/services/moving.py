"""States of sub-FSMs in which a motion is under way: begun, waited for, watched, judged, and cancelled when the call ends early."""

import logging
from collections.abc import Callable, Mapping
from typing import Any

from rapp_agent import Behaviour, Subsystem
from rapp_core.body_ports import Movement, Pose2D
from rapp_core.errors import CoreError, Refused
from rapp_core.services.context import Context
from rapp_core.services.reflexes import hazard

_log = logging.getLogger(__name__)
MOTION, POSTURE = "ALMotion", "ALRobotPosture"
TELLING = 0.2  # s between two feedbacks
FALLING = 1.0  # s that a fall takes at most
FEELING = 0.05  # s between two looks at what a walking robot feels

Begin = Callable[[Subsystem], Movement]
Watch = Callable[[Subsystem], None]
Feedback = Callable[[Subsystem], Mapping[str, Any]]


class Every:
    """Something done now and then; the first time at once."""

    def __init__(self, context: Context, seconds: float) -> None:
        self._now = context.now
        self._seconds = seconds
        self._next = float("-inf")

    def due(self) -> bool:
        """Whether it is to be done now."""
        now = self._now()
        due = now >= self._next
        if due:
            self._next = now + self._seconds
        return due


def nobody_watches(_share: Subsystem) -> None:
    """For a motion that nothing can be in the way of."""


def motion(
    context: Context,
    name: str,
    begin: Begin,
    label: str,
    module: str = MOTION,
    watch: Watch = nobody_watches,
    feedback: Feedback | None = None,
    explain: Watch = nobody_watches,
) -> Behaviour:
    """A state that begins a motion and ends with it. Raises Refused when the robot does not carry it out, or not in time.

    `label` is the method of NAOqi's `module` that `begin` calls.

    While it is under way `watch` may refuse it, and `feedback` tells how far it is; `explain` may say why a robot has ended it by
    itself, such as a NAO that has protected its feet.
    """
    telling = Every(context, TELLING)

    def enter(share: Subsystem) -> None:
        if not context.call.puts_back:
            context.calls.note_before(context.robot.motion.nearest_posture)
        movement = begin(share)
        share.memory.update(movement=movement, wait=movement.wait, undo=lambda: cancel(movement), arrived=False)
        share.memory["late"] = context.now() + context.config.motion_time

    def go_on(share: Subsystem) -> None:
        movement: Any = share.memory["movement"]
        if movement.done():
            if not movement.result():
                explain(share)
                raise Refused(f"cannot finish: the robot has ended {label} by itself; see whether it can move, and try again")
            share.memory.update(wait=None, undo=None, arrived=True)
            context.trace.reply(module, "core", label)
            return
        if context.now() > float(str(share.memory["late"])):
            raise Refused(f"cannot finish: {label} takes more than {context.config.motion_time:g} s; ask for less at a time")
        watch(share)
        if feedback is not None and context.call.feedback is not None and telling.due():
            context.call.feedback(feedback(share))

    return Behaviour(name, go_on, lambda share: bool(share.memory["arrived"]), on_enter=enter, label=label)


def cancel(movement: Movement) -> None:
    """Stop a motion whose call has ended before it; a robot that is away has nothing to be told."""
    try:
        movement.cancel()
    except CoreError as error:
        _log.warning("%s", error)


def standing_up(context: Context) -> Behaviour:
    """The state before a walk of a robot that does not stand."""
    speed = context.config.posture_speed
    return motion(context, "stand", lambda _share: _posture(context, "StandInit", speed), "goToPosture", POSTURE)


def _posture(context: Context, name: str, speed: float) -> Movement:
    context.trace.call("core", POSTURE, "goToPosture")
    return context.robot.motion.take_posture(name, speed)


def refuse_hazard(context: Context, way: Pose2D) -> None:
    """Raise Refused when the robot must not walk along `way`, what is left of it in base_link."""
    reason = hazard(context.robot.feeling.senses(), way, context.config.near)
    if reason is not None:
        raise Refused(f"cannot walk: {reason}")


def refuse_what_ended(context: Context, way: Pose2D) -> None:
    """Raise Refused with why a robot may have ended a walk by itself; one that falls has not fallen yet when it does so."""
    until = context.now() + FALLING
    while True:
        context.check()
        refuse_hazard(context, way)
        if context.now() >= until:
            return
        context.cut.wait(FEELING)
