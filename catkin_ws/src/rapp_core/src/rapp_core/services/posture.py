"""rapp_take_predefined_posture and rapp_rest: takePredefinedPosture and rest of the deliverable (section 4.5.2)."""

import logging
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from rapp_agent import Behaviour, Edge, Machine, Subsystem
from rapp_core.body_ports import Movement
from rapp_core.errors import Invalid
from rapp_core.services.context import Context, request
from rapp_core.services.joints import share_of_speed
from rapp_core.services.moving import POSTURE, motion

_log = logging.getLogger(__name__)
RESTING = ("Sit", "SitRelax", "Crouch", "LyingBelly", "LyingBack")


def check(context: Context, share: Subsystem) -> None:
    """Whether a request of rapp_take_predefined_posture is of use; notes the speed. Raises Invalid, Unreachable."""
    known = context.robot.motion.postures()
    if request(share, "posture") not in known:
        raise Invalid(f"cannot take posture {request(share, 'posture')!r}: known are {', '.join(known)}")
    share.memory["speed"] = share_of_speed(float(request(share, "speed")), context.config.posture_speed)


def machine(context: Context) -> Machine:
    """Sub-FSM: check, take the posture."""
    robot = context.robot.motion

    def take(share: Subsystem) -> Movement:
        context.trace.call("core", POSTURE, "goToPosture")
        return robot.take_posture(request(share, "posture"), float(str(share.memory["speed"])))

    def now(_share: Subsystem) -> Mapping[str, Any]:
        return {"posture": robot.posture()}

    return Machine(
        "rapp_take_predefined_posture",
        {
            "check": Behaviour("check", partial(check, context), label="check"),
            "take": motion(context, "take", take, "goToPosture", POSTURE, feedback=now),
        },
        "check",
        [Edge("check", "take")],
        ["take"],
    )


def comes_back(context: Context, before: str) -> bool:
    """Whether a robot is to be brought back to the posture in which it was before, then its motors off; else it just rests.

    A posture on straight legs needs motors, and a robot that has fallen is not made to get up unasked. Raises CoreError.
    """
    robot = context.robot
    return before in RESTING and before != robot.motion.nearest_posture() and not robot.feeling.senses().fallen


def check_rest(_context: Context, share: Subsystem) -> None:
    """Whether a request of rapp_rest is of use. Raises Invalid."""
    if (request(share, "posture") or RESTING[0]) not in RESTING:
        raise Invalid(f"cannot rest in posture {request(share, 'posture')!r}: known are {', '.join(RESTING)}")


def rest_machine(context: Context) -> Machine:
    """Sub-FSM: check, take the resting posture, switch the motors off."""

    def take(share: Subsystem) -> Movement:
        context.trace.call("core", POSTURE, "goToPosture")
        return context.robot.motion.take_posture(request(share, "posture") or RESTING[0], context.config.posture_speed)

    def relax(_share: Subsystem) -> Movement:
        context.trace.call("core", "ALMotion", "stiffnessInterpolation")
        return context.robot.motion.relax()

    return Machine(
        "rapp_rest",
        {
            "check": Behaviour("check", partial(check_rest, context), label="check"),
            "take": motion(context, "take", take, "goToPosture", POSTURE),
            "relax": motion(context, "relax", relax, "stiffnessInterpolation"),
        },
        "check",
        [Edge("check", "take"), Edge("take", "relax")],
        ["relax"],
    )


def back_machine(context: Context) -> Machine:
    """Sub-FSM after a RApp: take a posture, switch the motors off; let the robot rest when there is none, or it cannot take it."""
    rest, robot = rest_machine(context), context.robot.motion

    def release(share: Subsystem) -> Movement:
        context.check()  # whoever has ended the way back is not to be made to rest
        error = share.memory.get("error")
        if isinstance(error, Exception):
            _log.warning("the robot rests out of posture %s: %s", request(share, "posture"), error)
        context.trace.call("core", "ALMotion", "rest")
        return robot.release()

    def rested(share: Subsystem) -> None:
        share.memory.pop("error", None)

    return Machine(
        "rapp_rest",
        {**rest.states, "release": replace(motion(context, "release", release, "rest"), on_leave=rested)},
        "check",
        [
            Edge("check", "take", lambda share: bool(request(share, "posture")), "a posture"),
            Edge("check", "release"),
            Edge("take", "relax"),
        ],
        ["relax", "release"],
        failure="release",
    )
