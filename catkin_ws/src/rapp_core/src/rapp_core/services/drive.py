"""rapp_move_vel: moveVel of the deliverable (section 4.5.2), which does not block: the walk goes on after the reply."""

from rapp_agent import Behaviour, Edge, Machine, Subsystem
from rapp_core.body_ports import Movement, Pose2D
from rapp_core.errors import Invalid, Refused
from rapp_core.geometry import finite
from rapp_core.services.context import Context, reply, request
from rapp_core.services.moving import FEELING, Every, motion, refuse_hazard, refuse_what_ended, standing_up
from rapp_core.services.reflexes import lasting

POSTURE = "StandInit"


def check(context: Context, share: Subsystem) -> None:
    """Whether a request is of use, wherever the robot is. Raises Invalid, Refused."""
    velocity, config = _velocity(share), context.config
    if not finite(velocity.x, velocity.y, velocity.theta):
        raise Invalid("cannot walk so: x, y and theta must be numbers; m/s and rad/s")
    for name, value, most, unit in (
        ("x", velocity.x, config.walk_speed, "m/s"),
        ("y", velocity.y, config.side_speed, "m/s"),
        ("theta", velocity.theta, config.turn_speed, "rad/s"),
    ):
        if abs(value) > most * (1 + 1e-6):  # the request's numbers are of single precision
            raise Refused(f"cannot walk with {name} {value:g} {unit}: -{most:g} to {most:g} are allowed")


def machine(context: Context) -> Machine:
    """Sub-FSM: check; what follows is `drive_machine`."""

    def look(share: Subsystem) -> None:
        check(context, share)
        refuse_hazard(context, lasting(_velocity(share)))
        reply(share, message=context.calls.take_end(context.cut))

    return Machine("rapp_move_vel", {"check": Behaviour("check", look, label="check")}, "check", [], ["check"])


def drive_machine(context: Context) -> Machine:
    """Sub-FSM that goes on after the reply: StandInit, then walk until it is stopped; a new request changes the velocity."""
    robot, feeling = context.robot, Every(context, FEELING)

    def go(share: Subsystem) -> Movement:
        velocity = _velocity(share)
        share.memory["velocity"] = velocity
        context.trace.send("core", "ALMotion", "move")
        return robot.motion.move_velocity(velocity.x, velocity.y, velocity.theta)

    def watch(share: Subsystem) -> None:
        wanted = _velocity(share)
        if wanted != share.memory["velocity"]:
            go(share)
        share.memory["late"] = context.now() + context.config.motion_time  # the lease bounds it, not its length
        if feeling.due():
            refuse_hazard(context, lasting(wanted))

    def explain(share: Subsystem) -> None:
        refuse_what_ended(context, lasting(_velocity(share)))

    def prepared(_share: Subsystem) -> bool:
        return robot.motion.standing() and (robot.motion.moving() or robot.motion.posture() == POSTURE)

    return Machine(
        "rapp_move_vel",
        {
            "look": Behaviour("look", lambda _share: None, label="posture"),
            "stand": standing_up(context),
            "drive": motion(context, "drive", go, "move", watch=watch, explain=explain),
        },
        "look",
        [Edge("look", "drive", prepared, "StandInit"), Edge("look", "stand"), Edge("stand", "drive")],
        ["drive"],
    )


def _velocity(share: Subsystem) -> Pose2D:
    return Pose2D(*(float(request(share, name)) for name in ("x", "y", "theta")))
