"""SimWorld, the simulator's own module: people who speak in the room, its noise, its picture."""

from pathlib import Path

import qi

from rapp_nao_sim.naoqi import Module, NaoqiError, quick, working
from rapp_nao_sim.sound.room import Mixer, Sounding
from rapp_nao_sim.sound.samples import load
from rapp_nao_sim.sound.synthesis import speak
from rapp_nao_sim.speech.hearing import Hearing
from rapp_nao_sim.world.process import WorldClient

LOUDEST = 16_000.0  # RMS of 16-bit samples; more noise would be cut off at full scale


@qi.multiThreaded()
class SimWorld(Module):
    """What happens in the room beside the robot. Signals: `robotSaid(text)`, `personSpoke(text)`.

    Calls overlap: what two people say at once is mixed at the microphone.
    """

    def __init__(self, mixer: Mixer, hearing: Hearing, level: float, text_fed: bool, world: WorldClient | None) -> None:
        self.robotSaid = qi.Signal("(s)")
        self.personSpoke = qi.Signal("(s)")
        self.__mixer = mixer
        self.__hearing = hearing
        self.__level = level
        self.__text_fed = text_fed
        self.__world = world

    @working
    def personSay(self, text: str, voice: str, options: dict[str, float] | None = None) -> None:  # noqa: N802
        """A person says a text with an espeak-ng voice; ends when it has been said.

        Options: "speed" in words per minute (150), "level" from 0 to 1. With the text-fed microphone the words reach the ears
        at once, and the sound sounds on without being waited for.
        """
        wishes = {"speed": 150.0, "level": self.__level, **(options or {})}
        samples = speak(text, voice, int(wishes["speed"]))
        sounding = self.__mixer.add(Sounding(samples, float(wishes["level"])))
        if self.__text_fed:
            self.__hearing.feed_text(text)
        else:
            sounding.done.result()
        self.personSpoke(text)

    @working
    def personPlay(self, name: str) -> None:  # noqa: N802
        """A recording of a person sounds in the room; ends at its end."""
        self.__mixer.add(Sounding(load(Path(name)), 1.0)).done.result()

    @quick
    def micText(self, text: str) -> None:  # noqa: N802
        """Words for the text-fed microphone, without any sound."""
        if not self.__text_fed:
            raise NaoqiError("the microphone hears sound; start nao_sim with --microphone text")
        self.__hearing.feed_text(str(text))

    @quick
    def setNoise(self, level: float) -> None:  # noqa: N802
        """Noise floor of the room, root mean square of 16-bit samples; 60 is a quiet room, speech has about 2000."""
        if not 0 <= float(level) <= LOUDEST:
            raise NaoqiError(f"cannot set the noise to {level}: its level is from 0 to {LOUDEST:g}")
        self.__mixer.ambient = float(level)

    @quick
    def getNoise(self) -> float:  # noqa: N802
        """Noise floor of the room."""
        return self.__mixer.ambient

    @working
    def getRobotPose(self) -> list[float]:  # noqa: N802
        """True pose of the robot in the room: x and y in m, theta in rad."""
        return list(self.__there().robot_pose())

    @working
    def photograph(self, name: str) -> None:
        """Write a picture of the room as a PNG file."""
        self.__there().photograph(Path(name))

    def __there(self) -> WorldClient:
        if self.__world is None:
            raise NaoqiError("there is no world: nao_sim was started with --no-world")
        return self.__world
