"""The table of all core services: ROS name, types of rapp_msgs, sub-FSM, the resources it needs, its function in rapp_api."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rapp_agent import Machine, Subsystem
from rapp_core.services import drive, joints, picture, play, pose, posture, recognise, record, say, stop, walk
from rapp_core.services.calls import LIMBS
from rapp_core.services.context import Context

BODY = ("arms", "head", "legs")


@dataclass(frozen=True)
class CoreService:
    """One row; `resources` are held while the service runs, so that two services never fight for one device."""

    name: str
    srv: str
    machine: Callable[[Context], Machine]
    resources: tuple[str, ...]
    api: str
    action: bool = False
    """Whether there is an action of the same name, and of the type's name, too."""
    needs: Callable[[Mapping[str, Any]], Sequence[str]] | None = None
    """Which of the resources a request needs, when not all."""
    check: Callable[[Context, Subsystem], None] | None = None
    """Whether a request is of use, whatever the robot does: asked before anything else is ended for it."""
    after: Callable[[Context], Machine] | None = None
    """Sub-FSM that goes on after the reply, and holds the resources until another service wants them."""

    @property
    def moves(self) -> bool:
        """Whether it moves the robot."""
        return not LIMBS.isdisjoint(self.resources)


CORE_SERVICES = (
    CoreService("rapp_say", "Say", say.machine, ("loudspeaker",), "communication.text_to_speech"),
    CoreService("rapp_recognize", "Recognize", recognise.machine, ("recogniser",), "communication.word_spotting"),
    CoreService("rapp_record", "Record", record.machine, ("recorder",), "communication.capture_audio"),
    CoreService(
        "rapp_record_until_silence", "RecordUntilSilence", record.until_silence_machine, ("recorder",),
        "communication.capture_audio_until_silence",
    ),
    CoreService("rapp_play_audio", "PlayAudio", play.machine, ("loudspeaker",), "communication.play_audio"),
    CoreService("rapp_move_to", "MoveTo", walk.machine, ("legs",), "navigation.move_to", action=True, check=walk.check),
    CoreService(
        "rapp_move_vel", "MoveVel", drive.machine, ("legs",), "navigation.move_vel", check=drive.check, after=drive.drive_machine
    ),
    CoreService("rapp_move_stop", "MoveStop", stop.machine, (), "navigation.move_stop"),
    CoreService(
        "rapp_move_joint", "MoveJoint", joints.machine, BODY, "navigation.move_joint", action=True, needs=joints.limbs,
        check=joints.check,
    ),
    CoreService(
        "rapp_take_predefined_posture", "TakePosture", posture.machine, BODY, "navigation.take_predefined_posture", action=True,
        check=posture.check,
    ),
    CoreService(
        "rapp_look_at_point", "LookAtPoint", joints.look_machine, ("head",), "navigation.look_at_point", check=joints.check_look
    ),
    CoreService("rapp_rest", "Rest", posture.rest_machine, BODY, "navigation.rest", check=posture.check_rest),
    CoreService(
        "rapp_move_along_path", "MoveAlongPath", walk.path_machine, ("legs",), "navigation.move_along_path", action=True,
        check=walk.check_path,
    ),
    CoreService("rapp_set_global_pose", "SetGlobalPose", pose.set_machine, (), "navigation.set_global_pose"),
    CoreService("rapp_get_robot_pose", "GetRobotPose", pose.get_machine, (), "navigation.get_robot_pose"),
    CoreService("rapp_get_transform", "GetTransform", pose.transform_machine, (), "navigation.get_transform"),
    CoreService("rapp_capture_image", "CaptureImage", picture.machine, ("cameras",), "vision.capture_image"),
    CoreService("rapp_set_camera_param", "SetCameraParam", picture.param_machine, ("cameras",), "vision.set_camera_param"),
    CoreService("rapp_set_camera_params", "SetCameraParams", picture.params_machine, ("cameras",), "vision.set_camera_params"),
)  # fmt: skip
"""All services of the core agent that use the robot. Calls that leave the robot are in `services.outside`."""
PUT_BACK = CoreService("rapp_rest", "Rest", posture.back_machine, BODY, "navigation.rest")
"""The core agent's own, after a RApp that has moved the robot."""
