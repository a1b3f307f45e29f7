"""ALTextToSpeech: espeak-ng through the room's loudspeaker."""

from typing import Any

import numpy as np
import qi

from rapp_nao_sim.files import Files, write
from rapp_nao_sim.naoqi import Module, NaoqiError, promised, quick, working
from rapp_nao_sim.sound.synthesis import languages, speak
from rapp_nao_sim.speech.mouth import Mouth, Saying

SPEED = 150  # words per minute at NAOqi's normal speed of 100
NORMAL = 100.0
FILE_RATE = 22050  # Hz, of sayToFile


@qi.multiThreaded()
class ALTextToSpeech(Module):
    """Speech; texts are queued and said one after another."""

    def __init__(self, mouth: Mouth, english: str, echo: float, files: Files) -> None:
        self.__mouth = mouth
        self.__files = files
        self.__english = english
        self.__echo = echo
        self.__language, self.__voice = "English", english
        self.__volume = 1.0
        self.__speed = NORMAL

    @quick
    def say(self, text: str, language: str = "") -> Any:
        """Say a text; ends when it has been said, or stopped."""
        if not isinstance(text, str):
            raise NaoqiError("cannot say this: it is no text")
        voice = self.__voice_of(language) if language else self.__voice
        saying = Saying(text, voice, self.__words_per_minute(), self.__echo * self.__volume)
        return promised("ALTextToSpeech::say", self.__mouth.say(saying))

    @working
    def sayToFile(self, text: str, name: str) -> None:  # noqa: N802
        """Write what would be said into a file: raw samples of 16 bits, two channels at 22 050 Hz."""
        path = self.__files.writable(name)
        samples = speak(str(text), self.__voice, self.__words_per_minute(), FILE_RATE) * self.__volume
        write(path, np.repeat(np.clip(samples * 32767, -32768, 32767).astype("<i2"), 2).tobytes())

    def stopAll(self) -> None:  # noqa: N802
        """Stop saying, and forget what waits to be said."""
        self.__mouth.stop()

    def getAvailableLanguages(self) -> list[str]:  # noqa: N802
        """English names of all languages that can be spoken."""
        return sorted(languages())

    def getSupportedLanguages(self) -> list[str]:  # noqa: N802
        """As getAvailableLanguages."""
        return self.getAvailableLanguages()

    @quick
    def setLanguage(self, language: str) -> None:  # noqa: N802
        """Choose the language by its English name; an error when it cannot be spoken."""
        self.__voice = self.__voice_of(language)
        self.__language = language

    def getLanguage(self) -> str:  # noqa: N802
        """English name of the chosen language."""
        return self.__language

    @quick
    def getAvailableVoices(self) -> list[str]:  # noqa: N802
        """All voices, by espeak-ng's names."""
        return sorted({self.__english, *languages().values()})

    @quick
    def setVoice(self, voice: str) -> None:  # noqa: N802
        """Choose the voice, and so the language; an error when there is no such voice."""
        found = [name for name, code in languages().items() if code == voice]
        if voice != self.__english and not found:
            raise NaoqiError(f"voice {voice} is not installed; getAvailableVoices tells all")
        self.__voice, self.__language = voice, "English" if voice == self.__english else min(found, key=len)

    def getVoice(self) -> str:  # noqa: N802
        """The chosen voice."""
        return self.__voice

    @quick
    def setVolume(self, volume: float) -> None:  # noqa: N802
        """Volume from 0 to 1."""
        self.__volume = min(1.0, max(0.0, float(volume)))

    def getVolume(self) -> float:  # noqa: N802
        """Volume from 0 to 1."""
        return self.__volume

    @quick
    def setParameter(self, name: str, value: float) -> None:  # noqa: N802
        """Parameter "speed" in percent, 50 to 400; others of NAOqi are accepted and do nothing with this voice."""
        if name == "speed":
            self.__speed = min(400.0, max(50.0, float(value)))

    @quick
    def getParameter(self, name: str) -> float:  # noqa: N802
        """The parameter "speed"; this voice has no other."""
        if name != "speed":
            raise NaoqiError(f"cannot find parameter {name!r}: this voice has speed alone")
        return self.__speed

    def resetSpeed(self) -> None:  # noqa: N802
        """Speak at the normal speed."""
        self.__speed = NORMAL

    def __words_per_minute(self) -> int:
        return round(SPEED * self.__speed / NORMAL)

    def __voice_of(self, language: str) -> str:
        if language == "English":
            return self.__english
        if language not in languages():
            raise NaoqiError(f"language {language} is not installed")
        return languages()[language]
