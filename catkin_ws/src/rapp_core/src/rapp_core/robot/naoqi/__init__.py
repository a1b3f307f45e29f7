"""Virtual effectors and receptors on NAOqi, over the qi protocol (paper section II)."""

from rapp_core.config import Config
from rapp_core.ports import Robot
from rapp_core.robot.naoqi.camera import NaoqiCamera
from rapp_core.robot.naoqi.connection import Connection
from rapp_core.robot.naoqi.ears import NaoqiEars
from rapp_core.robot.naoqi.feeling import NaoqiFeeling
from rapp_core.robot.naoqi.motion import NaoqiMotion
from rapp_core.robot.naoqi.player import NaoqiPlayer
from rapp_core.robot.naoqi.recorder import NaoqiRecorder
from rapp_core.robot.naoqi.voice import NaoqiVoice


def subscriber(config: Config) -> str:
    """Name under which the core agent listens to the robot's extractors."""
    return f"rapp_{config.name}"


def robot(connection: Connection, config: Config) -> Robot:
    """All virtual effectors and receptors of one NAO."""
    return Robot(
        NaoqiVoice(connection),
        NaoqiEars(connection, subscriber(config)),
        NaoqiRecorder(connection),
        NaoqiPlayer(connection),
        NaoqiMotion(connection),
        NaoqiFeeling(connection, subscriber(config)),
        NaoqiCamera(connection, subscriber(config)),
        lambda: connection.present,
    )
