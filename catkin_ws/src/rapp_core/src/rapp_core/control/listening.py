"""State s3: hears isolated keywords, and records what is said so that a long command is not lost (paper section III)."""

import threading
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from rapp_core.config import Config
from rapp_core.errors import Unreachable
from rapp_core.ports import Robot, Sound, Word

STEP = 0.02  # s


class Listener:
    """One listening round after another: start, poll until something was said, stop."""

    def __init__(self, robot: Robot, config: Config, now: Callable[[], float]) -> None:
        self._robot = robot
        self._config = config
        self._now = now
        self._heard: deque[tuple[float, Word | Sound]] = deque(maxlen=256)

    def round(
        self, keywords: Sequence[str], recording: Path, stop: threading.Event, stale: Callable[[], bool] = lambda: False
    ) -> str | Path | None:
        """Listen once: a keyword (as spelt in `keywords`), the recording of a long command, or None when all was quiet.

        The round is over, too, once the keywords are `stale` and nobody speaks. Raises Unreachable when the robot is lost.
        """
        self._heard.clear()
        ears, recorder = self._robot.ears, self._robot.recorder
        if keywords:
            ears.set_vocabulary(keywords)
        recorder.start(recording)
        try:
            ears.subscribe(lambda item: self._heard.append((self._now(), item)))
            try:
                return self._poll(frozenset(keywords), recording, stop, stale)
            finally:
                ears.unsubscribe()
        finally:
            recorder.stop()

    def _poll(
        self, keywords: frozenset[str], recording: Path, stop: threading.Event, stale: Callable[[], bool]
    ) -> str | Path | None:
        until = self._now() + self._config.listening_round
        speech = _Speech(self._config)
        while not stop.wait(STEP):
            while self._heard:
                at, item = self._heard.popleft()
                if isinstance(item, Sound):
                    speech.take(at, item)
                elif item.probability >= self._config.threshold and item.text in keywords and speech.may_be_keyword():
                    return item.text
                else:
                    speech.rejected()
            if speech.is_command(self._now()):
                return recording
            if not self._robot.present():
                raise Unreachable("cannot listen: the robot is away")
            if (self._now() > until or stale()) and speech.quiet(self._now()):
                return None
        return None


class _Speech:
    """Sounds of one round put together: what follows within `_pause` belongs to the same utterance."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._begun: float | None = None
        self._ended: float | None = None
        self._rejected = False  # whether the recogniser has found no keyword in the last sound

    def take(self, at: float, sound: Sound) -> None:
        self._rejected = False
        if sound.begun:
            if self._begun is None or (self._ended is not None and at - self._ended > self._pause):
                self._begun = at
            self._ended = None
        elif self._begun is not None:
            self._ended = at

    def rejected(self) -> None:
        """Note that the recogniser has told something else than a keyword."""
        self._rejected = self._ended is not None

    @property
    def _pause(self) -> float:
        return max(self._config.end_of_command, self._config.verdict)

    def may_be_keyword(self) -> bool:
        """Whether what was said is short enough; a word may be told before the end of its sound, or without any."""
        if self._begun is None or self._ended is None:
            return True
        return self._ended - self._begun <= self._config.longest_keyword

    def is_command(self, now: float) -> bool:
        """Whether an utterance longer than a keyword has ended, and the recogniser has found none in it, or had its time."""
        config = self._config
        if self._begun is None:
            return False
        if self._ended is None:
            return now - self._begun >= config.longest_command
        length, quiet = self._ended - self._begun, now - self._ended
        judged = self._rejected or length > config.longest_keyword or quiet >= config.verdict
        return length >= config.long_command and quiet >= config.end_of_command and judged

    def quiet(self, now: float) -> bool:
        """Whether nobody is speaking, nor has just spoken."""
        return self._begun is None or (self._ended is not None and now - self._ended >= self._pause)
