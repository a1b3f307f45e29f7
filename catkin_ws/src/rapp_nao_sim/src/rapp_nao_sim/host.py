"""Builds the simulated robot of its parts and offers its modules over the qi protocol."""

import logging
import threading
from typing import Any

import qi

from rapp_nao_sim.config import Config
from rapp_nao_sim.files import Files
from rapp_nao_sim.modules.audio import ALAudioDevice, ALAudioPlayer, ALAudioRecorder
from rapp_nao_sim.modules.memory import ALMemory
from rapp_nao_sim.modules.sim_world import SimWorld
from rapp_nao_sim.modules.speech_recognition import ALSoundDetection, ALSpeechRecognition, Hearing
from rapp_nao_sim.modules.text_to_speech import ALTextToSpeech, Mouth
from rapp_nao_sim.sound.room import Mixer, Room
from rapp_nao_sim.speech.process import Ears

_log = logging.getLogger(__name__)


class Host:
    """The running simulator; `close` undoes `start` in reverse order."""

    def __init__(self, config: Config, world: Any) -> None:
        self._config = config
        self._world = world
        self._session = qi.Session()
        self._ears = Ears() if config.microphone == "sound" else None
        self._mixer = Mixer(config.ambient)
        self._room = Room(self._mixer)
        self._speaking = threading.Event()
        self._memory = ALMemory(self._session.service)
        self._hearing = Hearing(self._memory, self._ears, self._speaking)

    def start(self) -> int:
        """Start everything; gives the port of NAOqi."""
        if self._ears is not None:
            self._ears.start()
        self._session.listenStandalone(f"tcp://{self._config.address}:{self._config.port}")
        for name, module in self._modules().items():
            self._session.registerService(name, module)
        self._room.listen(self._hearing.feed)
        self._room.start()
        return int(str(self._session.url()).rsplit(":", 1)[1])

    def _modules(self) -> dict[str, Any]:
        config, mixer = self._config, self._mixer
        text_fed = config.microphone == "text"
        sim_world = SimWorld(mixer, self._hearing, config.person_level, text_fed, self._world)
        mouth = Mouth(
            mixer, self._memory, config.robot_voice, config.echo, config.voice == "silent", sim_world.robotSaid, self._speaking
        )
        modules = {
            "ALMemory": self._memory,
            "ALTextToSpeech": ALTextToSpeech(mouth),
            "ALSpeechRecognition": ALSpeechRecognition(self._hearing),
            "ALSoundDetection": ALSoundDetection(self._hearing),
            "ALAudioRecorder": ALAudioRecorder(self._room, Files(config.files)),
            "ALAudioDevice": ALAudioDevice(self._room, self._session.service),
            "ALAudioPlayer": ALAudioPlayer(mixer, config.echo),
            "SimWorld": sim_world,
        }
        if self._world is not None:
            from rapp_nao_sim.world.motion_modules import modules as motion

            modules |= motion(self._world)
        return modules

    def close(self) -> None:
        """Stop everything."""
        self._room.close()
        self._hearing.close()
        self._session.close()
        if self._ears is not None:
            self._ears.close()
