"""Virtual receptor r_mic on ALSpeechRecognition, ALSoundDetection and ALMemory (paper Fig. 6)."""

import contextlib
import threading
from collections.abc import Callable, Sequence
from typing import Any

from rapp_core.errors import CoreError
from rapp_core.ports import Sound, Word
from rapp_core.robot.naoqi.connection import Connection

LEARNING = 15.0  # s; an unknown word's pronunciation has to be made
PERIOD = 500  # ms, of the extractors, as the original project asked for
PRECISION = 0.0

Heard = Callable[[Word | Sound], None]


class NaoqiEars:
    """Isolated words of a vocabulary, and the beginnings and ends of sounds, as events."""

    def __init__(self, connection: Connection, name: str) -> None:
        self._connection = connection
        self._name = name
        self._lock = threading.Lock()
        self._links: list[tuple[Any, int]] = []

    def set_vocabulary(self, words: Sequence[str]) -> None:
        """NAOqi refuses a vocabulary while it recognises: pause, set, go on."""
        call = self._connection.call
        call("ALSpeechRecognition", "pause", True)
        try:
            call("ALSpeechRecognition", "setVocabulary", list(words), False, timeout=LEARNING)
        finally:
            call("ALSpeechRecognition", "pause", False)

    def subscribe(self, heard: Heard) -> None:
        """See `ports.Ears`."""

        def word(value: Any) -> None:
            if isinstance(value, list) and len(value) >= 2 and value[0]:
                heard(Word(str(value[0]), float(value[1])))

        def sound(value: Any) -> None:
            if isinstance(value, list) and value:
                heard(Sound(bool(value[-1][1])))

        with self._lock:
            self._link("WordRecognized", word)
            self._link("SoundDetected", sound)
            self._connection.call("ALSoundDetection", "subscribe", self._name, PERIOD, PRECISION)
            self._connection.call("ALSpeechRecognition", "subscribe", self._name, PERIOD, PRECISION)

    def _link(self, key: str, callback: Callable[[Any], None]) -> None:
        subscriber = self._connection.call("ALMemory", "subscriber", key)
        self._links.append((subscriber, subscriber.signal.connect(callback)))

    def unsubscribe(self) -> None:
        """See `ports.Ears`; a robot that is away has forgotten us already."""
        with self._lock:
            links, self._links = self._links, []
            for subscriber, link in links:
                with contextlib.suppress(RuntimeError):
                    subscriber.signal.disconnect(link)
            if links:
                for module in ("ALSpeechRecognition", "ALSoundDetection"):
                    with contextlib.suppress(CoreError):
                        self._connection.call(module, "unsubscribe", self._name)
