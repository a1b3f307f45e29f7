"""The room's sound: mixes what sounds at each instant of one sample clock and gives it to the microphone's listeners."""

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rapp_nao_sim.errors import SimError
from rapp_nao_sim.sound.samples import RATE, Samples

BLOCK = 320  # samples: 20 ms, the grain of the clock
MOST = 32  # things that sound at once
Block = npt.NDArray[np.int16]
Listener = Callable[[Block], None]

_log = logging.getLogger(__name__)


class CrowdedError(SimError):
    """Too much sounds at once."""


@dataclass(eq=False)
class Sounding:
    """Something that sounds; `done` is resolved with True at its end, with False when it was stopped."""

    samples: Samples
    gain: float  # at the microphone
    loop: bool = False
    loudspeaker: bool = False  # it is the robot's that sounds
    paused: bool = False
    position: int = 0
    done: "Future[bool]" = field(default_factory=Future)

    def next(self, count: int) -> Samples:
        """The next samples, padded with silence at the end."""
        piece = self.samples[self.position : self.position + count]
        self.position += count
        if self.loop and self.position >= len(self.samples):
            self.position = 0
        if len(piece) < count:
            piece = np.pad(piece, (0, count - len(piece)))
        return piece

    @property
    def ended(self) -> bool:
        """Whether nothing of it is left."""
        return self.position >= len(self.samples)


class Mixer:
    """What the microphone picks up, block by block; no clock of its own."""

    def __init__(self, ambient: float, seed: int = 1) -> None:
        self.ambient = ambient
        self.loudspeaker = 1.0  # gain of what the robot's loudspeaker gives
        self._random = np.random.default_rng(seed)
        self._lock = threading.Lock()
        self._sounding: list[Sounding] = []

    def add(self, sounding: Sounding) -> Sounding:
        """Let something sound from the next block on. Raises CrowdedError."""
        with self._lock:
            if len(self._sounding) >= MOST:
                raise CrowdedError(f"cannot play: {MOST} sounds sound already; stop some, or play it later")
            self._sounding.append(sounding)
        return sounding

    def stop(self, sounding: Sounding) -> None:
        """Stop something that sounds; no effect on what has ended."""
        with self._lock:
            if sounding not in self._sounding:
                return
            self._sounding.remove(sounding)
        sounding.done.set_result(False)

    def stop_all(self) -> None:
        """Stop everything."""
        with self._lock:
            sounding = list(self._sounding)
        for each in sounding:
            self.stop(each)

    def block(self) -> Block:
        """The next 20 ms at the microphone."""
        mixed = self._random.normal(0, self.ambient / 32768, BLOCK) if self.ambient > 0 else np.zeros(BLOCK)
        with self._lock:
            for sounding in self._sounding:
                if not sounding.paused:
                    mixed += sounding.gain * (self.loudspeaker if sounding.loudspeaker else 1.0) * sounding.next(BLOCK)
            ended = [s for s in self._sounding if s.ended]
            self._sounding = [s for s in self._sounding if not s.ended]
        for sounding in ended:
            sounding.done.set_result(True)
        block: Block = np.clip(mixed * 32767, -32768, 32767).astype(np.int16)
        return block


class Room:
    """The sample clock: a thread that draws one block every 20 ms and hands it to all listeners."""

    def __init__(self, mixer: Mixer) -> None:
        self.mixer = mixer
        self.open = True  # the microphones; closed, they give nothing to anybody
        self._lock = threading.Lock()
        self._listeners: list[Listener] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="sound", daemon=True)

    def start(self) -> None:
        """Start the clock."""
        self._thread.start()

    def close(self) -> None:
        """Stop the clock and what sounds."""
        self._stop.set()
        self._thread.join(2)
        self.mixer.stop_all()

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Give every block to `listener`, in the clock's thread; gives the function that ends that."""
        with self._lock:
            self._listeners = [*self._listeners, listener]  # a new list: the clock goes through the old one without the lock

        def end() -> None:
            with self._lock:
                self._listeners = [x for x in self._listeners if x is not listener]

        return end

    def _run(self) -> None:
        due = time.monotonic()
        while not self._stop.is_set():
            block = self.mixer.block()
            for listener in self._listeners if self.open else ():
                try:
                    listener(block)
                except (RuntimeError, OSError, ValueError):
                    _log.exception("a listener of the microphone failed")
            due += BLOCK / RATE
            delay = due - time.monotonic()
            if delay > 0:
                self._stop.wait(delay)
            elif delay < -1:
                _log.warning("the sound clock was %.1f s late and starts anew", -delay)
                due = time.monotonic()
