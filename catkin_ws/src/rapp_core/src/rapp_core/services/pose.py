"""rapp_set_global_pose, rapp_get_robot_pose, rapp_get_transform: the frames of the deliverable (section 4.5.2)."""

from rapp_agent import Behaviour, Machine, Subsystem
from rapp_core.body_ports import Pose2D
from rapp_core.errors import Invalid
from rapp_core.geometry import finite
from rapp_core.services.context import Context, reply, request

SPACES = {0: "torso", 1: "world", 2: "robot"}


def set_machine(context: Context) -> Machine:
    """Sub-FSM: the core agent keeps where the robot is in the map."""

    def tell(share: Subsystem) -> None:
        pose: Pose2D = request(share, "pose")
        if not finite(pose.x, pose.y, pose.theta):
            raise Invalid("cannot take this pose: its position and orientation must be numbers")
        context.place.tell(pose, context.robot.motion.pose())

    return Machine("rapp_set_global_pose", {"set": Behaviour("set", tell, label="place in map")}, "set", [], ["set"])


def get_machine(context: Context) -> Machine:
    """Sub-FSM: where the robot is in the map."""

    def ask(share: Subsystem) -> None:
        reply(share, pose=context.place.in_map(context.robot.motion.pose()))

    return Machine("rapp_get_robot_pose", {"get": Behaviour("get", ask, label="pose in map")}, "get", [], ["get"])


def transform_machine(context: Context) -> Machine:
    """Sub-FSM: where a part of the robot is."""

    def ask(share: Subsystem) -> None:
        space = request(share, "space")
        if space not in SPACES:
            known = ", ".join(f"{number} {name}" for number, name in SPACES.items())
            raise Invalid(f"cannot use space {space}: known are {known}")
        reply(share, transform=context.robot.motion.transform(request(share, "name"), space))

    return Machine("rapp_get_transform", {"get": Behaviour("get", ask, label="getTransform")}, "get", [], ["get"])
