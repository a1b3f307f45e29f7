"""ALTextToSpeech: espeak-ng through the room's loudspeaker."""

import threading
from collections.abc import Callable
from dataclasses import dataclass

import qi

from rapp_nao_sim.modules.memory import ALMemory
from rapp_nao_sim.naoqi import Module, NaoqiError, working
from rapp_nao_sim.sound.room import Mixer, Sounding
from rapp_nao_sim.sound.synthesis import VoiceError, languages, speak

SPEED = 150  # words per minute at NAOqi's normal speed of 100


@dataclass(frozen=True)
class Mouth:
    """What saying needs."""

    mixer: Mixer
    memory: ALMemory
    voice: str  # espeak-ng voice of English
    echo: float  # share of the voice that the microphone picks up
    silent: bool  # say takes no time and does not sound
    said: Callable[[str], None]  # told each text when it has been said
    speaking: threading.Event  # set while the robot speaks


@qi.multiThreaded()
class ALTextToSpeech(Module):
    """Speech; texts are queued and said one after another."""

    def __init__(self, mouth: Mouth) -> None:
        self.__mouth = mouth
        self.__turn = threading.Lock()
        self.__language = "English"
        self.__volume = 1.0
        self.__speed = 100.0
        self.__sounding: Sounding | None = None
        self.__stops = 0

    @working
    def say(self, text: str, language: str = "") -> None:
        """Say a text; ends when it has been said."""
        voice = self.__voice_of(language or self.__language)
        stops = self.__stops
        with self.__turn:
            if stops == self.__stops:
                self.__say(text, voice)

    def __say(self, text: str, voice: str) -> None:
        mouth = self.__mouth
        try:
            samples = speak(text, voice, round(SPEED * self.__speed / 100))
        except VoiceError as error:
            raise NaoqiError(str(error)) from error
        mouth.memory.raiseEvent("ALTextToSpeech/CurrentSentence", text)
        mouth.memory.raiseEvent("ALTextToSpeech/TextStarted", 1)
        mouth.speaking.set()
        try:
            if not mouth.silent:
                self.__sounding = mouth.mixer.add(Sounding(samples, mouth.echo * self.__volume))
                self.__sounding.done.result()
        finally:
            mouth.speaking.clear()
        mouth.memory.raiseEvent("ALTextToSpeech/TextStarted", 0)
        mouth.memory.raiseEvent("ALTextToSpeech/TextDone", 1)
        mouth.said(text)

    def stopAll(self) -> None:  # noqa: N802
        """Stop saying, and forget what waits to be said."""
        self.__stops += 1
        if self.__sounding is not None:
            self.__mouth.mixer.stop(self.__sounding)

    def getAvailableLanguages(self) -> list[str]:  # noqa: N802
        """English names of all languages that can be spoken."""
        return sorted(set(languages().values()) | {"English"})

    def getSupportedLanguages(self) -> list[str]:  # noqa: N802
        """As getAvailableLanguages."""
        return self.getAvailableLanguages()

    def setLanguage(self, language: str) -> None:  # noqa: N802
        """Choose the language by its English name; an error when it cannot be spoken."""
        self.__voice_of(language)
        self.__language = language

    def getLanguage(self) -> str:  # noqa: N802
        """English name of the chosen language."""
        return self.__language

    def setVolume(self, volume: float) -> None:  # noqa: N802
        """Volume from 0 to 1."""
        self.__volume = min(1.0, max(0.0, float(volume)))

    def getVolume(self) -> float:  # noqa: N802
        """Volume from 0 to 1."""
        return self.__volume

    def setParameter(self, name: str, value: float) -> None:  # noqa: N802
        """Parameter "speed" in percent, 50 to 400; others of NAOqi are accepted and do nothing with this voice."""
        if name == "speed":
            self.__speed = min(400.0, max(50.0, float(value)))

    def __voice_of(self, language: str) -> str:
        if language == "English":
            return self.__mouth.voice
        codes = [code for code, name in languages().items() if name == language]
        if not codes:
            raise NaoqiError(f"ALTextToSpeech\n\tlanguage {language} is not installed")
        return codes[0]
