"""ALSpeechRecognition and ALSoundDetection: what the ears hear, raised in ALMemory."""

import qi

from rapp_nao_sim.modules.extractor import Extractor
from rapp_nao_sim.naoqi import NaoqiError, quick, working
from rapp_nao_sim.sound.room import BLOCK
from rapp_nao_sim.sound.samples import RATE
from rapp_nao_sim.speech.hearing import Hearing

PERIOD = 1000 * BLOCK // RATE  # ms: the ears listen block by block


@qi.multiThreaded()
class ALSpeechRecognition(Extractor):
    """Recognition of words of a small vocabulary."""

    def __init__(self, hearing: Hearing) -> None:
        def change(name: str, on: bool) -> None:
            (hearing.subscribe if on else hearing.unsubscribe)(name)

        super().__init__(change, PERIOD, ["WordRecognized", "SpeechDetected"], ["LastWordRecognized"])
        self.__hearing = hearing
        self.__language = "English"

    @working
    def setVocabulary(self, words: list[str], _word_spotting: bool = False) -> None:  # noqa: N802
        """Listen for these words; spotting them within sentences is not offered and treated as isolated words."""
        if not isinstance(words, list) or not words or not all(isinstance(w, str) and w.strip() for w in words):
            raise NaoqiError("cannot use this vocabulary: give a list of words, at least one")
        self.__hearing.set_vocabulary(words)

    def setWordListAsVocabulary(self, words: list[str]) -> object:  # noqa: N802
        """As setVocabulary(words, False)."""
        return self.setVocabulary(words, False)

    def pause(self, paused: bool) -> None:
        """Pause recognition, or go on with it."""
        self.__hearing.pause(bool(paused))

    def isPaused(self) -> bool:  # noqa: N802
        """Whether recognition is paused."""
        return self.__hearing.paused

    @quick
    def setLanguage(self, language: str) -> None:  # noqa: N802
        """Choose the language; only English is installed."""
        if language != self.__language:
            raise NaoqiError(f"language {language} is not installed; installed is {self.__language}")

    def getLanguage(self) -> str:  # noqa: N802
        """The language."""
        return self.__language

    def getAvailableLanguages(self) -> list[str]:  # noqa: N802
        """Installed languages."""
        return [self.__language]

    def setParameter(self, _name: str, _value: float) -> None:  # noqa: N802
        """Accepted: the simulated ears have nothing to set."""

    def setAudioExpression(self, _on: bool) -> None:  # noqa: N802
        """Accepted: there are no beeps to switch."""

    def setVisualExpression(self, _on: bool) -> None:  # noqa: N802
        """Accepted: there are no lights to switch."""


@qi.multiThreaded()
class ALSoundDetection(Extractor):
    """Starts (type 1) and ends (type 0) of sounds, raised as SoundDetected."""

    def __init__(self, hearing: Hearing) -> None:
        super().__init__(hearing.detect, PERIOD, ["SoundDetected"])

    def setParameter(self, _name: str, _value: float) -> None:  # noqa: N802
        """Accepted: the sensitivity adapts to the room by itself."""
