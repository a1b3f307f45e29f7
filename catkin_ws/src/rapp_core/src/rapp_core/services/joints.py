"""rapp_move_joint and rapp_look_at_point: moveJoint and lookAtPoint of the deliverable (section 4.5.2)."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from rapp_agent import Behaviour, Edge, Machine, Subsystem
from rapp_core.body_ports import Movement
from rapp_core.errors import Invalid
from rapp_core.geometry import finite
from rapp_core.services.context import Context, request
from rapp_core.services.moving import motion

ROUNDING = 1e-3  # rad; the ranges are known rounded, and the request's numbers are of single precision
FARTHEST = 100.0  # m of a point to look at


def limbs(fields: Mapping[str, Any]) -> Sequence[str]:
    """The limbs that a request of rapp_move_joint moves."""
    return sorted({_limb(str(name)) for name in fields["joints"]})


def _limb(joint: str) -> str:
    if joint.startswith("Head"):
        return "head"
    return "legs" if any(part in joint for part in ("Hip", "Knee", "Ankle")) else "arms"


def share_of_speed(speed: float, default: float) -> float:
    """The share of the greatest speed that a request means; 0 is the default. Raises Invalid."""
    if not 0 <= speed <= 1:  # nor a number that is none
        raise Invalid(f"cannot move at speed {speed:g}: give a share of the greatest speed, above 0 and at most 1")
    return speed or default


def check(context: Context, share: Subsystem) -> None:
    """Whether a request of rapp_move_joint is of use; notes the angles and the speed. Raises Invalid, Unreachable."""
    joints, angles = list(request(share, "joints")), list(map(float, request(share, "angles")))
    if not joints or len(joints) != len(angles) or len(set(joints)) != len(joints):
        raise Invalid("cannot move joints: name each joint once, and give one angle (rad) for each")
    share.memory["angles"] = dict(zip(joints, (_angle(context, *pair) for pair in zip(joints, angles, strict=True)), strict=True))
    share.memory["speed"] = share_of_speed(float(request(share, "speed")), context.config.joint_speed)


def machine(context: Context) -> Machine:
    """Sub-FSM: check, move."""
    robot = context.robot.motion

    def move(share: Subsystem) -> Movement:
        angles: Any = share.memory["angles"]
        context.trace.call("core", "ALMotion", "angleInterpolationWithSpeed")
        return robot.move_joints(angles, float(str(share.memory["speed"])))

    def now(share: Subsystem) -> Mapping[str, Any]:
        return {"angles": robot.angles(request(share, "joints"))}

    return Machine(
        "rapp_move_joint",
        {
            "check": Behaviour("check", partial(check, context), label="check"),
            "move": motion(context, "move", move, "angleInterpolationWithSpeed", feedback=now),
        },
        "check",
        [Edge("check", "move")],
        ["move"],
    )


def _angle(context: Context, joint: str, angle: float) -> float:
    limits = context.robot.motion.limits()
    if joint not in limits:
        raise Invalid(f"cannot move {joint!r}: this robot's joints are {', '.join(limits)}")
    lower, upper = limits[joint].lower, limits[joint].upper
    if not lower - ROUNDING <= angle <= upper + ROUNDING:
        raise Invalid(f"cannot move {joint} to {angle:g} rad: {lower:g} to {upper:g} are possible")
    return min(max(angle, lower), upper)


def check_look(_context: Context, share: Subsystem) -> None:
    """Whether a request of rapp_look_at_point is of use, wherever the neck is. Raises Invalid."""
    point = _point(share)
    if not finite(*point) or max(map(abs, point)) > FARTHEST:
        raise Invalid(f"cannot look there: x, y and z must be numbers, at most {FARTHEST:g} m")


def look_machine(context: Context) -> Machine:
    """Sub-FSM: check, turn the head."""

    def look(share: Subsystem) -> Movement:
        context.trace.call("core", "ALMotion", "angleInterpolationWithSpeed")
        return context.robot.motion.look_at(*_point(share), context.config.joint_speed)

    return Machine(
        "rapp_look_at_point",
        {
            "check": Behaviour("check", partial(check_look, context), label="check"),
            "look": motion(context, "look", look, "angleInterpolationWithSpeed"),
        },
        "check",
        [Edge("check", "look")],
        ["look"],
    )


def _point(share: Subsystem) -> tuple[float, float, float]:
    x, y, z = (float(request(share, name)) for name in ("x", "y", "z"))
    return x, y, z
