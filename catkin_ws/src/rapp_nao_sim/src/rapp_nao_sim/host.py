"""Builds the simulated robot of its parts and offers its modules over the qi protocol."""

import logging
import threading
from contextlib import ExitStack
from typing import Any

import qi

from rapp_nao_sim.config import Config
from rapp_nao_sim.errors import StartError
from rapp_nao_sim.files import Files
from rapp_nao_sim.modules.audio_device import ALAudioDevice
from rapp_nao_sim.modules.audio_player import ALAudioPlayer
from rapp_nao_sim.modules.audio_recorder import ALAudioRecorder
from rapp_nao_sim.modules.battery import ALBattery
from rapp_nao_sim.modules.body_senses import BodySenses
from rapp_nao_sim.modules.memory import ALMemory
from rapp_nao_sim.modules.photo_capture import ALPhotoCapture
from rapp_nao_sim.modules.sim_world import SimWorld
from rapp_nao_sim.modules.sonar import ALSonar
from rapp_nao_sim.modules.speech_recognition import ALSoundDetection, ALSpeechRecognition
from rapp_nao_sim.modules.text_to_speech import ALTextToSpeech
from rapp_nao_sim.modules.video_clients import all_dials
from rapp_nao_sim.modules.video_device import ALVideoDevice
from rapp_nao_sim.sound.room import Mixer, Room
from rapp_nao_sim.speech.hearing import Hearing
from rapp_nao_sim.speech.mouth import Mouth
from rapp_nao_sim.speech.process import Ears
from rapp_nao_sim.world.motion_modules import modules as motion_modules
from rapp_nao_sim.world.process import WorldClient, WorldConfig

_log = logging.getLogger(__name__)


class Host:
    """The running simulator; `close` undoes `start` in reverse order, however far that came."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._undo = ExitStack()
        self._session = qi.Session()
        self._world = WorldClient(WorldConfig(room=config.room, window=config.gui)) if config.world else None
        self._ears = Ears() if config.microphone == "sound" else None
        self._mixer = Mixer(config.ambient)
        self._room = Room(self._mixer)
        self._senses = BodySenses(self._world) if self._world is not None else None
        self._memory = ALMemory(self._session.service, self._senses)
        speaking = threading.Event()
        self._hearing = Hearing(self._memory.insertData, self._memory.raiseEvent, self._ears, speaking)
        self._sim_world = SimWorld(self._mixer, self._hearing, config.person_level, self._ears is None, self._world)
        self._mouth = Mouth(self._mixer, self._memory.raiseEvent, self._sim_world.robotSaid, speaking, config.voice == "silent")

    def start(self) -> int:
        """Start everything; gives the port of NAOqi. Raises StartError, WorldError."""
        config, undo = self._config, self._undo
        if self._world is not None and self._senses is not None:
            self._world.start()
            undo.callback(self._senses.close)
            undo.callback(self._world.close)  # before the senses, which wait for what it tells
            self._senses.start(self._memory.insertData, self._memory.raiseEvent)
        self._listen()
        undo.callback(self._session.close)
        for part in (self._hearing, self._mouth, self._room):
            part.start()
            undo.callback(part.close)
        if self._ears is not None:
            self._ears.start()
            undo.callback(self._ears.close)
        self._room.listen(self._hearing.feed)
        for name, module in self._modules().items():
            self._session.registerService(name, module)
        _log.info("a NAO is simulated at %s, voice %s, microphone %s", self._session.url(), config.voice, config.microphone)
        return int(str(self._session.url()).rsplit(":", 1)[1])

    def _listen(self) -> None:
        place = f"{self._config.address}:{self._config.port}"
        try:
            self._session.listenStandalone(f"tcp://{place}")
        except RuntimeError as error:
            reason = " ".join(str(error).split())
            if "already in use" in reason:
                reason = "another program listens there; end it, or choose another --port (0: any free one)"
            raise StartError(f"cannot listen on {place}: {reason}") from error

    def _modules(self) -> dict[str, Any]:
        config, mixer = self._config, self._mixer
        modules = {
            "ALMemory": self._memory,
            "ALTextToSpeech": ALTextToSpeech(self._mouth, config.robot_voice, config.echo, Files(config.files)),
            "ALSpeechRecognition": ALSpeechRecognition(self._hearing),
            "ALSoundDetection": ALSoundDetection(self._hearing),
            "ALAudioRecorder": ALAudioRecorder(self._room, Files(config.files)),
            "ALAudioDevice": ALAudioDevice(self._room, self._session.service),
            "ALAudioPlayer": ALAudioPlayer(mixer, config.echo),
            "SimWorld": self._sim_world,
        }
        if self._world is None:
            return modules
        world = self._world
        dials = all_dials()
        seeing = {
            "ALVideoDevice": ALVideoDevice(world, dials),
            "ALPhotoCapture": ALPhotoCapture(world, dials, Files(config.files)),
        }
        feeling = {"ALSonar": ALSonar(world), "ALBattery": ALBattery(world)}
        return modules | motion_modules(world) | seeing | feeling

    def look_after(self) -> None:
        """Start ears that have died anew. Raises StartError when the body has died: the robot cannot go on without."""
        if self._ears is not None:
            self._ears.revive()
        if self._world is not None and not self._world.alive():
            raise StartError("cannot go on: the process of the robot's body has died; start nao_sim again")

    def close(self) -> None:
        """Stop everything."""
        self._undo.close()
