"""The table of all core services: ROS name, type of rapp_msgs, sub-FSM, the resources it needs, its function in rapp_api."""

from collections.abc import Callable
from dataclasses import dataclass

from rapp_agent import Machine
from rapp_core.services import play, recognise, record, say
from rapp_core.services.context import Context


@dataclass(frozen=True)
class CoreService:
    """One row; `resources` are held while the service runs, so that two services never fight for one device."""

    name: str
    srv: str
    machine: Callable[[Context], Machine]
    resources: tuple[str, ...]
    api: str


CORE_SERVICES = (
    CoreService("rapp_say", "Say", say.machine, ("loudspeaker",), "communication.text_to_speech"),
    CoreService("rapp_recognize", "Recognize", recognise.machine, ("recogniser",), "communication.word_spotting"),
    CoreService("rapp_record", "Record", record.machine, ("recorder",), "communication.capture_audio"),
    CoreService(
        "rapp_record_until_silence", "RecordUntilSilence", record.until_silence_machine, ("recorder",),
        "communication.capture_audio_until_silence",
    ),
    CoreService("rapp_play_audio", "PlayAudio", play.machine, ("loudspeaker",), "communication.play_audio"),
)  # fmt: skip
"""All services of the core agent that use the robot. Calls that leave the robot are in `services.outside`."""
