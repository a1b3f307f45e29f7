"""The core agent's own word, by which a person stops the robot, heard beside the words of whoever else listens.

A NAO has one recogniser with one vocabulary, so the word is added to each vocabulary, and is the whole vocabulary while nobody else
listens. It is the core agent's whoever listens: a RApp with the same word in its dictionary does not get it.
"""

import contextlib
import threading
import time
from collections.abc import Callable, Sequence

from rapp_core.config import Config
from rapp_core.errors import CoreError, Unreachable
from rapp_core.ports import Ears, Sound, Voice, Word

JUDGED = 5.0  # s the recogniser takes at most; a word told later has another sound

Heard = Callable[[Word | Sound], None]


class OwnVoice:
    """A `ports.Voice` that knows whether the robot speaks: what the ears hear meanwhile is no person."""

    def __init__(self, voice: Voice, config: Config, now: Callable[[], float] = time.monotonic) -> None:
        self._voice = voice
        self._verdict = config.verdict
        self._now = now
        self._lock = threading.Lock()
        self._texts = 0
        self._ended = float("-inf")

    def say(self, text: str, language: str) -> None:
        """See `ports.Voice`."""
        with self._lock:
            self._texts += 1
        try:
            self._voice.say(text, language)
        finally:
            with self._lock:
                self._texts -= 1
                self._ended = self._now()

    def hush(self) -> None:
        """See `ports.Voice`."""
        self._voice.hush()

    @property
    def heard(self) -> bool:
        """Whether what the recogniser tells now may be the robot itself, which speaks or has just spoken."""
        with self._lock:
            return self._texts > 0 or self._now() - self._ended < self._verdict


class Attention:
    """A `ports.Ears` for everybody else; from `attend` to `ignore` it listens for the core agent's word as well.

    The word counts when it is said alone: within a sentence, such as one that a RApp records, it is part of that.
    """

    def __init__(
        self, ears: Ears, word: str | None, config: Config, voice: OwnVoice, now: Callable[[], float] = time.monotonic
    ) -> None:
        """Prepare.

        :param word: the core agent's; None: there is none in the person's language
        """
        self._ears = ears
        self._word = word
        self._threshold = config.stop_threshold
        self._longest = config.long_command
        self._voice = voice
        self._now = now
        self._begun: float | None = None  # when the present sound did
        self._ended = float("-inf")  # when the last one did
        self._length = 0.0  # s of that
        self._lock = threading.Lock()
        self._words: list[str] = []  # of whoever else listens, or is about to
        self._heard: Heard | None = None  # whoever else listens
        self._called: Callable[[str], None] | None = None  # to be told of the core agent's word

    def set_vocabulary(self, words: Sequence[str]) -> None:
        """See `ports.Ears`."""
        with self._lock:
            self._words = list(words)
            self._ears.set_vocabulary(self._vocabulary())

    def subscribe(self, heard: Heard) -> None:
        """See `ports.Ears`."""
        with self._lock:
            if self._called is not None:
                self._ears.unsubscribe()  # from the core agent's word alone
            self._heard = heard
            self._ears.subscribe(self._take)

    def unsubscribe(self) -> None:
        """See `ports.Ears`."""
        with self._lock:
            self._heard, self._words = None, []
            self._ears.unsubscribe()
            if self._called is not None:
                with contextlib.suppress(CoreError):  # a robot that is away is attended to again by whoever notices it
                    self._listen()

    def attend(self, called: Callable[[str], None]) -> None:
        """Tell `called` the core agent's word from now on, from a foreign thread. Raises CoreError.

        To be called again after the robot was away (Unreachable); a word that it does not take is left out.
        """
        if self._word is None:
            return
        with self._lock:
            again, self._called = self._called is not None, called
            try:
                if self._heard is not None and not again:
                    self._ears.set_vocabulary(self._vocabulary())
                else:
                    self._ears.unsubscribe()
                    self._listen()
            except Unreachable:
                raise
            except CoreError:
                self._called = None
                raise

    def ignore(self) -> None:
        """End `attend`; no error when there was none."""
        with self._lock:
            attended, self._called = self._called, None
            if attended is not None and self._heard is None:
                self._ears.unsubscribe()

    def _listen(self) -> None:
        self._ears.set_vocabulary(self._vocabulary())
        self._ears.subscribe(self._take)

    def _vocabulary(self) -> list[str]:
        """Words are told apart by sound, so the same one is not to be there twice."""
        if self._word is None or self._called is None:
            return self._words
        return [*(word for word in self._words if not self._is_own(word)), self._word]

    def _is_own(self, word: str) -> bool:
        return self._word is not None and word.strip().casefold() == self._word

    def _take(self, item: Word | Sound) -> None:
        heard, called = self._heard, self._called
        if isinstance(item, Sound):
            self._measure(item)
        if called is None or not isinstance(item, Word) or not self._is_own(item.text):
            if heard is not None:
                heard(item)
        elif item.probability >= self._threshold and not self._voice.heard and self._alone():
            called(item.text)

    def _measure(self, sound: Sound) -> None:
        if sound.begun:
            self._begun = self._now()
        elif self._begun is not None:
            self._ended = self._now()
            self._length, self._begun = self._ended - self._begun, None

    def _alone(self) -> bool:
        """Whether its sound was short enough for the word, which may be told before the end of it, or without any."""
        return self._begun is not None or self._length < self._longest or self._now() - self._ended > JUDGED
