"""ALSpeechRecognition and ALSoundDetection: what the microphone hears, raised in ALMemory."""

import logging
import queue
import threading
import time
from collections.abc import Sequence

import qi

from rapp_nao_sim.modules.memory import ALMemory
from rapp_nao_sim.naoqi import Module, NaoqiError, working
from rapp_nao_sim.sound.endpointer import Ended, Endpointer, Started
from rapp_nao_sim.sound.room import Block
from rapp_nao_sim.speech.process import Ears, EarsError
from rapp_nao_sim.speech.text import match

_log = logging.getLogger(__name__)
NOTHING = ["", -3.0]  # what WordRecognized holds until a word is heard


class Hearing:
    """Sounds from the microphone to words: endpoints in the sound clock's thread, recognition in a thread of its own.

    While the robot itself speaks it does not listen, as the real one.
    """

    def __init__(self, memory: ALMemory, ears: Ears | None, speaking: threading.Event) -> None:
        self._memory = memory
        self._ears = ears
        self._speaking = speaking
        self._endpointer = Endpointer()
        self._work: queue.Queue[Block | str | None] = queue.Queue(maxsize=8)
        self._lock = threading.Lock()
        self._subscribers: set[str] = set()
        self._detectors: set[str] = set()
        self._vocabulary: list[str] = []
        self._paused = False
        self._thread = threading.Thread(target=self._recognise, name="hearing", daemon=True)
        memory.insertData("WordRecognized", NOTHING)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._work.put(None)
        self._thread.join(2)

    def feed(self, block: Block) -> None:
        """Take 20 ms of the microphone; called by the sound clock."""
        if self._speaking.is_set():
            self._endpointer = Endpointer()
            return
        change = self._endpointer.feed(block)
        if isinstance(change, Started):
            self._detected(1)
        elif isinstance(change, Ended):
            self._detected(0)
            if self._ears is not None:
                self._offer(change.samples)

    def feed_text(self, text: str) -> None:
        """Take words as text: the text-fed microphone."""
        if not self._speaking.is_set():
            self._offer(text)

    def _offer(self, sound: Block | str) -> None:
        if not self.listening:
            return
        try:
            self._work.put_nowait(sound)
        except queue.Full:
            _log.warning("a sound is not recognised: %d wait already", self._work.maxsize)

    @property
    def listening(self) -> bool:
        """Whether words are wanted."""
        with self._lock:
            return bool(self._subscribers) and not self._paused and bool(self._vocabulary)

    def detect(self, name: str, wanted: bool) -> None:
        """Want, or want no longer, SoundDetected."""
        (self._detectors.add if wanted else self._detectors.discard)(name)

    def _detected(self, kind: int) -> None:
        if self._detectors:
            self._memory.raiseEvent("SoundDetected", [[0, kind, 1.0, int(time.time() * 1e6) % 2**31]])
        if self.listening:
            self._memory.raiseEvent("SpeechDetected", kind)

    def subscribe(self, name: str) -> None:
        """Want words."""
        with self._lock:
            self._subscribers.add(name)
        self._memory.insertData("WordRecognized", NOTHING)

    def unsubscribe(self, name: str) -> None:
        """Want words no longer."""
        with self._lock:
            self._subscribers.discard(name)

    def pause(self, paused: bool) -> None:
        """Stop listening for a while."""
        with self._lock:
            self._paused = paused

    def set_vocabulary(self, words: Sequence[str]) -> None:
        """Change the vocabulary; an error while listening, and for words nobody can pronounce."""
        if self.listening:
            raise NaoqiError("cannot set the vocabulary while recognition is running: pause it first")
        if self._ears is not None:
            try:
                self._ears.learn(words)
            except (ValueError, EarsError) as error:
                raise NaoqiError(str(error)) from error
        with self._lock:
            self._vocabulary = list(words)

    def _recognise(self) -> None:
        while (sound := self._work.get()) is not None:
            with self._lock:
                vocabulary = list(self._vocabulary)
            try:
                if isinstance(sound, str):
                    words = match(sound, vocabulary)
                else:
                    assert self._ears is not None
                    words = self._ears.recognise(vocabulary, sound)
            except (EarsError, ValueError) as error:
                _log.warning("%s", error)
                continue
            if words and self.listening:
                value = [part for word in words for part in word]
                self._memory.insertData("LastWordRecognized", value)
                self._memory.raiseEvent("WordRecognized", value)


@qi.multiThreaded()
class ALSpeechRecognition(Module):
    """Recognition of words of a small vocabulary."""

    def __init__(self, hearing: Hearing) -> None:
        self.__hearing = hearing
        self.__language = "English"

    @working
    def setVocabulary(self, words: list[str], _word_spotting: bool = False) -> None:  # noqa: N802
        """Listen for these words; spotting them within sentences is not offered and treated as isolated words."""
        if not isinstance(words, list) or not all(isinstance(w, str) and w.strip() for w in words):
            raise NaoqiError("the vocabulary must be a list of words")
        self.__hearing.set_vocabulary(words)

    def setWordListAsVocabulary(self, words: list[str]) -> object:  # noqa: N802
        """As setVocabulary(words, False)."""
        return self.setVocabulary(words, False)

    def subscribe(self, name: str, *_period_precision: float) -> None:
        """Start raising WordRecognized."""
        self.__hearing.subscribe(name)

    def unsubscribe(self, name: str) -> None:
        """Stop raising WordRecognized."""
        self.__hearing.unsubscribe(name)

    def pause(self, paused: bool) -> None:
        """Pause recognition, or go on with it."""
        self.__hearing.pause(bool(paused))

    def setLanguage(self, language: str) -> None:  # noqa: N802
        """Choose the language; only English is installed."""
        if language != "English":
            raise NaoqiError(f"ALSpeechRecognition::setLanguage\n\tlanguage {language} is not installed")

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
class ALSoundDetection(Module):
    """Starts (type 1) and ends (type 0) of sounds, raised as SoundDetected."""

    def __init__(self, hearing: Hearing) -> None:
        self.__hearing = hearing

    def subscribe(self, name: str, *_period_precision: float) -> None:
        """Start raising SoundDetected."""
        self.__hearing.detect(name, True)

    def unsubscribe(self, name: str) -> None:
        """Stop raising SoundDetected."""
        self.__hearing.detect(name, False)

    def setParameter(self, _name: str, _value: float) -> None:  # noqa: N802
        """Accepted: the sensitivity adapts to the room by itself."""
