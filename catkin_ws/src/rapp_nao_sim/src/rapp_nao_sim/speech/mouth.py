"""What the robot says: one text after another, each of which can be stopped before, during and after its synthesis."""

import logging
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

from rapp_nao_sim.errors import SimError
from rapp_nao_sim.sound.room import Mixer, Sounding
from rapp_nao_sim.sound.samples import Samples
from rapp_nao_sim.sound.synthesis import speak

MOST = 50  # texts that wait
LEAVING = 0.5  # s for the thread to end; a synthesis under way is not waited for

_log = logging.getLogger(__name__)


class MouthError(SimError):
    """The text is not said: too many wait."""


@dataclass(eq=False)
class Saying:
    """A text to say; `done` is resolved with True when it was said, with False when it was stopped, else with a SimError."""

    text: str
    voice: str  # of espeak-ng
    speed: int  # words per minute
    gain: float  # at the microphone
    done: "Future[bool]" = field(default_factory=Future)


class Mouth:
    """Says texts through the loudspeaker, in a thread of its own, and raises ALTextToSpeech's events.

    `said` is told each text that was said to its end; `speaking` is set while one sounds.
    """

    def __init__(
        self,
        mixer: Mixer,
        raise_event: Callable[[str, Any], None],
        said: Callable[[str], None],
        speaking: threading.Event,
        silent: bool = False,  # texts take no time and do not sound
        synthesise: Callable[[str, str, int], Samples] = speak,
    ) -> None:
        self._mixer = mixer
        self._raise = raise_event
        self._said = said
        self._speaking = speaking
        self._silent = silent
        self._synthesise = synthesise
        self._changed = threading.Condition()
        self._waiting: deque[Saying] = deque()
        self._present: Saying | None = None
        self._sounding: Sounding | None = None
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="mouth", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """Stop saying, end the thread."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self.stop()
        self._thread.join(LEAVING)

    def say(self, saying: Saying) -> "Future[bool]":
        """Say a text after those that wait; gives its `done`. Raises MouthError."""
        with self._changed:
            if self._ended or len(self._waiting) >= MOST:
                raise MouthError(f"cannot say this: {len(self._waiting)} texts wait to be said; stop them, or say it later")
            self._waiting.append(saying)
            self._changed.notify()
        return saying.done

    def stop(self) -> None:
        """Stop the present text, forget those that wait."""
        with self._changed:
            stopped, sounding = list(self._waiting), self._sounding
            self._waiting.clear()
            self._present = None
        for saying in stopped:
            saying.done.set_result(False)
        if sounding is not None:
            self._mixer.stop(sounding)

    def _run(self) -> None:
        while (saying := self._next()) is not None:
            try:
                saying.done.set_result(self._say(saying))
            except Exception as error:  # noqa: BLE001 - told to who waits for it; the next text may be better
                _log.warning("%r is not said: %s", saying.text, error)
                saying.done.set_exception(error)

    def _next(self) -> Saying | None:
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._waiting)
            self._present = None if self._ended else self._waiting.popleft()
            return self._present

    def _say(self, saying: Saying) -> bool:
        samples = None if self._silent else self._synthesise(saying.text, saying.voice, saying.speed)
        if not self._begin(saying, samples):
            return False
        self._raise("ALTextToSpeech/CurrentSentence", saying.text)
        self._raise("ALTextToSpeech/TextStarted", 1)
        complete = self._end(saying)
        self._raise("ALTextToSpeech/TextStarted", 0)
        self._raise("ALTextToSpeech/TextDone" if complete else "ALTextToSpeech/TextInterrupted", 1)
        if complete:
            self._said(saying.text)
        return complete

    def _begin(self, saying: Saying, samples: Samples | None) -> bool:
        """Let it sound, unless it was stopped meanwhile."""
        with self._changed:
            if self._present is not saying:
                return False
            if samples is not None:
                self._sounding = self._mixer.add(Sounding(samples, saying.gain, loudspeaker=True))
            self._speaking.set()
            return True

    def _end(self, saying: Saying) -> bool:
        """Wait for the end of its sound; gives False when it was stopped."""
        sounding = self._sounding
        complete = sounding is None or sounding.done.result()
        with self._changed:
            self._speaking.clear()
            self._sounding = None
            complete = complete and self._present is saying
            self._present = None
            return complete
