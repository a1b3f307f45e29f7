"""From the microphone to words: endpoints in the sound clock's thread, recognition in a thread of its own."""

import contextlib
import logging
import queue
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rapp_nao_sim.errors import SimError
from rapp_nao_sim.sound.endpointer import Ended, Endpointer, Started
from rapp_nao_sim.sound.room import Block
from rapp_nao_sim.speech.process import Ears, EarsError
from rapp_nao_sim.speech.text import match

MOST = 8  # sounds that wait to be recognised
NOTHING = ["", -3.0]  # what WordRecognized holds until a word is heard

Tell = Callable[[str, Any], None]

_log = logging.getLogger(__name__)


class HearingError(SimError):
    """The vocabulary cannot be changed now."""


@dataclass(frozen=True)
class Heard:
    """A sound, or words as text, and the number of the vocabulary that was listened for."""

    sound: Block | str
    vocabulary: int


class Hearing:
    """What ALSpeechRecognition and ALSoundDetection share; `insert` and `raise_event` are ALMemory's.

    While the robot itself speaks it does not listen, as the real one. A sound is matched against the vocabulary of its time only.
    """

    def __init__(self, insert: Tell, raise_event: Tell, ears: Ears | None, speaking: threading.Event) -> None:
        self._insert = insert
        self._raise = raise_event
        self._ears = ears
        self._speaking = speaking
        self._endpointer = Endpointer()
        self._work: queue.Queue[Heard | None] = queue.Queue(MOST)
        self._lock = threading.Lock()
        self._subscribers: set[str] = set()
        self._detectors: set[str] = set()
        self._vocabulary: list[str] = []
        self._number = 0  # of the vocabulary
        self.paused = False  # see `pause`
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="hearing", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._insert("WordRecognized", NOTHING)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._ended.set()
        with contextlib.suppress(queue.Full):  # then it is awake, and looks by itself
            self._work.put_nowait(None)
        self._thread.join(2)

    def feed(self, block: Block) -> None:
        """Take 20 ms of the microphone; called by the sound clock."""
        if self._speaking.is_set():
            if self._endpointer.interrupt():
                self._detected(0)
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
        with self._lock:
            heard = Heard(sound, self._number) if self._listens() else None
        if heard is not None:
            try:
                self._work.put_nowait(heard)
            except queue.Full:
                _log.warning("a sound is not recognised: %d wait already", MOST)

    def _listens(self) -> bool:
        return bool(self._subscribers) and not self.paused and bool(self._vocabulary)

    @property
    def listening(self) -> bool:
        """Whether words are wanted."""
        with self._lock:
            return self._listens()

    def detect(self, name: str, wanted: bool) -> None:
        """Want, or want no longer, SoundDetected."""
        with self._lock:
            (self._detectors.add if wanted else self._detectors.discard)(name)

    def _detected(self, kind: int) -> None:
        if self._detectors:
            self._raise("SoundDetected", [[0, kind, 1.0, int(time.time() * 1e6) % 2**31]])
        if self.listening:
            self._raise("SpeechDetected", kind)

    def subscribe(self, name: str) -> None:
        """Want words."""
        with self._lock:
            self._subscribers.add(name)
        self._insert("WordRecognized", NOTHING)

    def unsubscribe(self, name: str) -> None:
        """Want words no longer."""
        with self._lock:
            self._subscribers.discard(name)

    def pause(self, paused: bool) -> None:
        """Stop listening for a while."""
        with self._lock:
            self.paused = paused

    def set_vocabulary(self, words: Sequence[str]) -> None:
        """Change the vocabulary. Raises HearingError while listening, EarsError for words nobody can pronounce."""
        if self.listening:
            raise HearingError("cannot set the vocabulary while recognition is running: pause it first")
        if self._ears is not None:
            self._ears.learn(words)
        with self._lock:
            self._vocabulary = list(words)
            self._number += 1

    def _run(self) -> None:
        while (heard := self._work.get()) is not None and not self._ended.is_set():
            try:
                self._recognise(heard)
            except EarsError as error:
                _log.warning("%s", error)

    def _recognise(self, heard: Heard) -> None:
        with self._lock:
            vocabulary = list(self._vocabulary)
        if not self._current(heard):
            return
        if isinstance(heard.sound, str):
            words = match(heard.sound, vocabulary)
        else:
            assert self._ears is not None
            words = self._ears.recognise(vocabulary, heard.sound)
        if words and self._current(heard):
            value = [part for word in words for part in word]
            self._insert("LastWordRecognized", value)
            self._raise("WordRecognized", value)

    def _current(self, heard: Heard) -> bool:
        with self._lock:
            return self._listens() and heard.vocabulary == self._number
