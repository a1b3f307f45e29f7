"""SimWorld, the simulator's own module: people who speak in the room, its noise, its picture."""

import threading
from pathlib import Path
from typing import Any

import qi
import soundfile

from rapp_nao_sim.modules.speech_recognition import Hearing
from rapp_nao_sim.naoqi import Module, NaoqiError, working
from rapp_nao_sim.sound.room import Mixer, Sounding
from rapp_nao_sim.sound.synthesis import RATE, VoiceError, resample, speak


@qi.multiThreaded()
class SimWorld(Module):
    """What happens in the room beside the robot. Signals: `robotSaid(text)`, `personSpoke(text)`."""

    def __init__(self, mixer: Mixer, hearing: Hearing, level: float, text_fed: bool, world: Any) -> None:
        self.robotSaid = qi.Signal("(s)")
        self.personSpoke = qi.Signal("(s)")
        self.__mixer = mixer
        self.__hearing = hearing
        self.__level = level
        self.__text_fed = text_fed
        self.__world = [world]
        self.__turn = threading.Lock()

    @working
    def personSay(self, text: str, voice: str, options: dict[str, float] | None = None) -> None:  # noqa: N802
        """A person says a text with an espeak-ng voice; ends when it has been said.

        Options: "speed" in words per minute (150), "level" from 0 to 1. With the text-fed microphone the words reach the ears
        at once, and the sound sounds on without being waited for.
        """
        wishes = options or {}
        try:
            samples = speak(text, voice, int(wishes.get("speed", 150)))
        except VoiceError as error:
            raise NaoqiError(str(error)) from error
        sounding = Sounding(samples, float(wishes.get("level", self.__level)))
        if self.__text_fed:
            self.__mixer.add(sounding)
            self.__hearing.feed_text(text)
        else:
            self.__sound(sounding)
        self.personSpoke(text)

    @working
    def personPlay(self, name: str) -> None:  # noqa: N802
        """A recording of a person sounds in the room; ends at its end."""
        if not Path(name).is_file():
            raise NaoqiError(f"cannot play {name}: there is no such file")
        samples, rate = soundfile.read(name, dtype="float64", always_2d=True)
        self.__sound(Sounding(resample(samples.mean(axis=1), rate, RATE), 1.0))

    def __sound(self, sounding: Sounding) -> None:
        with self.__turn:
            self.__mixer.add(sounding).done.result()

    def micText(self, text: str) -> None:  # noqa: N802
        """Words for the text-fed microphone, without any sound."""
        if not self.__text_fed:
            raise NaoqiError("SimWorld::micText\n\tthe microphone hears sound; start nao_sim with --microphone text")
        self.__hearing.feed_text(text)

    def setNoise(self, level: float) -> None:  # noqa: N802
        """Noise floor of the room, root mean square of 16-bit samples."""
        self.__mixer.ambient = max(0.0, float(level))

    @working
    def getRobotPose(self) -> list[float]:  # noqa: N802
        """True pose of the robot in the room: x and y in m, theta in rad."""
        return list(self.__there().robot_pose())

    @working
    def photograph(self, name: str) -> None:
        """Write a picture of the room as a PNG file."""
        self.__there().photograph(Path(name))

    def __there(self) -> Any:
        if self.__world[0] is None:
            raise NaoqiError("there is no world: nao_sim was started with --no-world")
        return self.__world[0]
