"""Where sound begins and ends: an adaptive floor, on at +8 dB, off at +5 dB, after a hang-over."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from rapp_nao_sim.sound.room import BLOCK, Block
from rapp_nao_sim.sound.samples import RATE

ON = 10 ** (8 / 20)  # times the floor
OFF = 10 ** (5 / 20)  # times the floor
HANG = 0.45  # s below OFF until a sound has ended: shorter gaps are within words
LEAD = 0.30  # s kept from before the start
STEADY = 2.0  # s without any quieter moment, which speech has: what sounds is noise, and its level the new floor
LONGEST = 20.0  # s; a longer sound is cut here


@dataclass(frozen=True)
class Started:
    """A sound has begun."""


@dataclass(frozen=True)
class Ended:
    """A sound has ended; `samples` are it with its surroundings, `duration` is its own length in s."""

    samples: Block
    duration: float


def energy(block: Block) -> float:
    """Root mean square of a block."""
    return float(np.sqrt(np.mean(np.square(block.astype(np.float64))))) if len(block) else 0.0


class Endpointer:
    """Takes blocks of 20 ms, tells starts and ends of sounds."""

    def __init__(self) -> None:
        self._floor = 0.0
        self._lead: deque[Block] = deque(maxlen=round(LEAD * RATE / BLOCK))
        self._levels: deque[float] = deque(maxlen=round(STEADY * RATE / BLOCK))
        self._sound: list[Block] = []
        self._loud = 0
        self._quiet = 0

    def feed(self, block: Block) -> Started | Ended | None:
        """Take one block; gives what it changed."""
        level = energy(block)
        if self._sound:
            return self._during(block, level)
        if not self._floor:
            self._floor = max(level, 1.0)
        self._lead.append(block)
        if level > ON * self._floor:
            self._loud += 1
            if self._loud >= 3:
                self._sound = list(self._lead)
                self._quiet = 0
                return Started()
        else:
            self._loud = 0
            self._floor += (level - self._floor) * (0.05 if level < self._floor * 1.5 else 0.01)
            self._floor = max(self._floor, 1.0)
        return None

    def interrupt(self) -> bool:
        """Forget the present sound, keep the floor; gives whether there was one."""
        sounded = bool(self._sound)
        self._forget()
        return sounded

    def _during(self, block: Block, level: float) -> Ended | None:
        self._sound.append(block)
        self._levels.append(level)
        if len(self._levels) == self._levels.maxlen:
            self._floor = max(self._floor, min(self._levels))
        self._quiet = self._quiet + 1 if level < OFF * self._floor else 0
        seconds = len(self._sound) * BLOCK / RATE
        quiet = self._quiet * BLOCK / RATE
        if quiet < HANG and seconds < LONGEST:
            return None
        samples = np.concatenate(self._sound)
        self._forget()
        return Ended(samples, max(seconds - LEAD - quiet, BLOCK / RATE))

    def _forget(self) -> None:
        self._sound = []
        self._loud = 0
        self._lead.clear()
        self._levels.clear()
