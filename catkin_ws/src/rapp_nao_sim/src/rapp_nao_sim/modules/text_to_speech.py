"""ALTextToSpeech: espeak-ng through the room's loudspeaker."""

from typing import Any

import qi

from rapp_nao_sim.naoqi import Module, NaoqiError, promised, quick
from rapp_nao_sim.sound.synthesis import languages
from rapp_nao_sim.speech.mouth import Mouth, Saying

SPEED = 150  # words per minute at NAOqi's normal speed of 100


@qi.multiThreaded()
class ALTextToSpeech(Module):
    """Speech; texts are queued and said one after another."""

    def __init__(self, mouth: Mouth, english: str, echo: float) -> None:
        self.__mouth = mouth
        self.__english = english
        self.__echo = echo
        self.__language = "English"
        self.__volume = 1.0
        self.__speed = 100.0

    @quick
    def say(self, text: str, language: str = "") -> Any:
        """Say a text; ends when it has been said, or stopped."""
        if not isinstance(text, str):
            raise NaoqiError("cannot say this: it is no text")
        voice = self.__voice_of(language or self.__language)
        saying = Saying(text, voice, round(SPEED * self.__speed / 100), self.__echo * self.__volume)
        return promised("ALTextToSpeech::say", self.__mouth.say(saying))

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
        self.__voice_of(language)
        self.__language = language

    def getLanguage(self) -> str:  # noqa: N802
        """English name of the chosen language."""
        return self.__language

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

    def __voice_of(self, language: str) -> str:
        if language == "English":
            return self.__english
        if language not in languages():
            raise NaoqiError(f"language {language} is not installed")
        return languages()[language]
