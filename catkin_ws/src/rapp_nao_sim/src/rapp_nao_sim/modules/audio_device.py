"""ALAudioDevice: energy of the microphones, volume of the loudspeaker, and samples for modules of clients."""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import qi

from rapp_nao_sim.naoqi import Module, NaoqiError, quick, working
from rapp_nao_sim.sound.endpointer import energy
from rapp_nao_sim.sound.room import Block, Room
from rapp_nao_sim.sound.samples import RATE

ENERGY_GAIN = 8.0  # puts the room's noise below 1700 and speech above, where the deliverable has its limit
PERIOD = 2730  # samples: 170 ms, NAOqi's period of audio
BEHIND = 6  # periods that a client's module may be behind; it misses the next ones

_log = logging.getLogger(__name__)


class Feed:
    """Gives a client's module its samples, every 170 ms, until it does not take them any more."""

    def __init__(self, module: Any, name: str) -> None:
        self._module = module
        self._name = name
        self._raw = _takes_raw(module)
        self._waiting: Block = np.zeros(0, np.int16)
        self._under_way: deque[Any] = deque()
        self._gone = False

    def feed(self, block: Block) -> None:
        """Take 20 ms of the microphone."""
        self._waiting = np.concatenate([self._waiting, block])
        if self._gone or len(self._waiting) < PERIOD:
            return
        samples, self._waiting = self._waiting[:PERIOD], self._waiting[PERIOD:]
        while self._under_way and self._under_way[0].isFinished():
            self._under_way.popleft()
        if len(self._under_way) < BEHIND:
            self._give(samples.astype("<i2").tobytes())

    def _give(self, raw: bytes) -> None:
        seconds = time.time()
        stamp = [int(seconds), int(seconds % 1 * 1e6)]
        value = raw if self._raw else raw.decode("latin-1")
        try:
            self._under_way.append(self._module.call("processRemote", 1, PERIOD, stamp, value, _async=True))
        except RuntimeError as error:
            _log.info("%s gets no more samples: %s", self._name, error)
            self._gone = True


def _takes_raw(module: Any) -> bool:
    """Whether processRemote declares its samples as raw (qi.Buffer).

    The Python binding of libqi cannot send bytes to a parameter of no declared type; such a module gets a string with one character
    for each byte.
    """
    methods = module.metaObject()["methods"].values()
    signatures = [method["parametersSignature"] for method in methods if method["name"] == "processRemote"]
    if not signatures:
        raise NaoqiError("cannot give samples: the module has no method processRemote")
    return any(signature.endswith("r)") for signature in signatures)


@qi.multiThreaded()
class ALAudioDevice(Module):
    """Energy of the microphones, volume of the loudspeaker, and samples for modules of clients."""

    def __init__(self, room: Room, fetch: Callable[[str], Any]) -> None:
        self.__fetch = [fetch]
        self.__room = room
        self.__volume = 100
        self.__muted = False
        self.__level = 0.0
        self.__recent: list[Block] = []
        self.__lock = threading.Lock()
        self.__clients: dict[str, Callable[[], None]] = {}
        room.listen(self.__measure)

    def __measure(self, block: Block) -> None:
        self.__recent = [*self.__recent[-(PERIOD // len(block)) :], block]
        self.__level = energy(np.concatenate(self.__recent))

    def enableEnergyComputation(self) -> None:  # noqa: N802
        """Accepted: the energy is always computed."""

    def disableEnergyComputation(self) -> None:  # noqa: N802
        """Accepted."""

    def getFrontMicEnergy(self) -> float:  # noqa: N802
        """Energy of the last 170 ms at the front microphone."""
        return self.__level * ENERGY_GAIN if self.__room.open else 0.0

    def getLeftMicEnergy(self) -> float:  # noqa: N802
        """As getFrontMicEnergy: the four microphones of this robot hear the same."""
        return self.getFrontMicEnergy()

    def getRightMicEnergy(self) -> float:  # noqa: N802
        """As getFrontMicEnergy."""
        return self.getFrontMicEnergy()

    def getRearMicEnergy(self) -> float:  # noqa: N802
        """As getFrontMicEnergy."""
        return self.getFrontMicEnergy()

    def closeAudioInputs(self) -> None:  # noqa: N802
        """Close the microphones: nobody hears or records anything until they are opened."""
        self.__room.open = False

    def openAudioInputs(self) -> None:  # noqa: N802
        """Open the microphones, as they are at the start."""
        self.__room.open = True

    @quick
    def muteAudioOut(self, mute: bool) -> None:  # noqa: N802
        """Whether the loudspeaker is silent; what it would play goes on."""
        self.__muted = bool(mute)
        self.__set_loudspeaker()

    def isAudioOutMuted(self) -> bool:  # noqa: N802
        """Whether the loudspeaker is silent."""
        return self.__muted

    @quick
    def setOutputVolume(self, volume: int) -> None:  # noqa: N802
        """Volume of the loudspeaker in percent."""
        self.__volume = min(100, max(0, int(volume)))
        self.__set_loudspeaker()

    def getOutputVolume(self) -> int:  # noqa: N802
        """Volume in percent."""
        return self.__volume

    @quick
    def setClientPreferences(self, _name: str, rate: int, channels: int, _deinterleaved: int) -> None:  # noqa: N802
        """What a client's module will be given: one channel at 16 kHz is what there is."""
        if int(rate) != RATE or int(channels) not in (1, 2, 3, 4):
            raise NaoqiError(f"only single channels at {RATE} Hz are simulated")

    @working
    def subscribe(self, name: str) -> None:
        """Call `name`.processRemote(channels, samples, [s, us], raw) every 170 ms; again: with its new module."""
        try:
            module = self.__fetch[0](name)
        except RuntimeError as error:
            raise NaoqiError(f"cannot find module {name}: {error}") from error
        with self.__lock:
            self.__end(name)
            self.__clients[name] = self.__room.listen(Feed(module, name).feed)

    @quick
    def unsubscribe(self, name: str) -> None:
        """End subscribe."""
        with self.__lock:
            self.__end(name)

    def __set_loudspeaker(self) -> None:
        self.__room.mixer.loudspeaker = 0.0 if self.__muted else self.__volume / 100

    def __end(self, name: str) -> None:
        end = self.__clients.pop(name, None)
        if end is not None:
            end()
