"""rapp_move_stop: moveStop of the deliverable (section 4.5.2). It holds no resource, and so never waits for another call."""

from rapp_agent import Behaviour, Machine, Subsystem
from rapp_core.services.context import Context, reply

STOPPED = "stopped"
"""What the callers of the motions that are stopped are told."""


def machine(context: Context) -> Machine:
    """Sub-FSM: end all calls that move the robot, or wait to, then stop the robot."""

    def stop(share: Subsystem) -> None:
        context.calls.end(STOPPED)  # first: a motion that ends by itself now would count as failed
        context.trace.call("core", "ALMotion", "stopMove")
        context.robot.motion.stop()
        context.trace.reply("ALMotion", "core", "stopMove")
        reply(share, message=context.calls.take_end(context.cut))

    return Machine("rapp_move_stop", {"stop": Behaviour("stop", stop, label="stop")}, "stop", [], ["stop"])
