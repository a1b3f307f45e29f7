"""ALAudioPlayer through the room's loudspeaker."""

import itertools
import threading
from dataclasses import dataclass
from pathlib import Path

import qi

from rapp_nao_sim.naoqi import Module, NaoqiError, quick, working
from rapp_nao_sim.sound.room import Mixer, Sounding
from rapp_nao_sim.sound.samples import RATE, Samples, load

MOST_LOADED = 32  # files


@dataclass
class Loaded:
    """A file that loadFile gave a number."""

    samples: Samples
    last: Sounding | None = None

    @property
    def sounding(self) -> Sounding | None:
        """Its playing, which may be paused."""
        return None if self.last is None or self.last.done.done() else self.last


@qi.multiThreaded()
class ALAudioPlayer(Module):
    """Plays files through the loudspeaker."""

    def __init__(self, mixer: Mixer, echo: float) -> None:
        self.__mixer = mixer
        self.__echo = echo
        self.__lock = threading.Lock()
        self.__playing: set[Sounding] = set()
        self.__master = 1.0
        self.__loaded: dict[int, Loaded] = {}
        self.__numbers = itertools.count(1)

    @working
    def playFile(self, name: str, volume: float = 1.0, pan: float = 0.0) -> None:  # noqa: N802
        """Play a file to its end."""
        self.__play(name, 0.0, volume, pan, False)

    @working
    def playFileFromPosition(self, name: str, position: float, volume: float = 1.0, pan: float = 0.0) -> None:  # noqa: N802
        """Play a file from a position in s to its end."""
        self.__play(name, position, volume, pan, False)

    @working
    def playFileInLoop(self, name: str, volume: float = 1.0, pan: float = 0.0) -> None:  # noqa: N802
        """Play a file again and again until it is stopped."""
        self.__play(name, 0.0, volume, pan, True)

    @working
    def getFileLengthFromPath(self, name: str) -> float:  # noqa: N802
        """Length of a file in s."""
        return len(load(Path(name))) / RATE

    @working
    def loadFile(self, name: str) -> int:  # noqa: N802
        """Load a file; gives its number, for the methods below, until unloadFile."""
        samples = load(Path(name))
        with self.__lock:
            if len(self.__loaded) >= MOST_LOADED:
                raise NaoqiError(f"cannot load {name}: {MOST_LOADED} files are loaded; unload some")
            number = next(self.__numbers)
            self.__loaded[number] = Loaded(samples)
            return number

    @quick
    def unloadFile(self, number: int) -> None:  # noqa: N802
        """Stop and forget a loaded file."""
        sounding = self.__find(number).sounding
        self.__loaded.pop(number, None)
        if sounding is not None:
            self.__mixer.stop(sounding)

    @working
    def play(self, number: int, volume: float = 1.0, pan: float = 0.0) -> None:
        """Play a loaded file to its end; when it is paused: go on with it."""
        file = self.__find(number)
        with self.__lock:
            sounding = file.sounding or self.__begin(file.samples, volume, pan)
            file.last, sounding.paused = sounding, False
        self.__wait(sounding)

    @quick
    def pause(self, number: int) -> None:
        """Pause a loaded file that plays; who plays it waits on. No effect on one that does not."""
        sounding = self.__find(number).sounding
        if sounding is not None:
            sounding.paused = True

    @quick
    def getFileLength(self, number: int) -> float:  # noqa: N802
        """Length of a loaded file in s."""
        return len(self.__find(number).samples) / RATE

    @quick
    def getCurrentPosition(self, number: int) -> float:  # noqa: N802
        """Where in a loaded file its playing is, s; 0 when it does not play."""
        sounding = self.__find(number).sounding
        return 0.0 if sounding is None else sounding.position / RATE

    def stopAll(self) -> None:  # noqa: N802
        """Stop all that plays."""
        with self.__lock:
            playing = list(self.__playing)
        for sounding in playing:
            self.__mixer.stop(sounding)

    @quick
    def setMasterVolume(self, volume: float) -> None:  # noqa: N802
        """Volume from 0 to 1 of all that is played from now on."""
        self.__master = min(1.0, max(0.0, float(volume)))

    def __find(self, number: int) -> Loaded:
        if number not in self.__loaded:
            raise NaoqiError(f"cannot find file {number!r}: loaded are {sorted(self.__loaded)}")
        return self.__loaded[number]

    def __play(self, name: str, position: float, volume: float, pan: float, loop: bool) -> None:
        samples = load(Path(name))
        start = round(float(position) * RATE)
        if not 0 <= start < max(1, len(samples)):
            raise NaoqiError("cannot play: position must lie in the file")
        self.__wait(self.__begin(samples[start:], volume, pan, loop))

    def __begin(self, samples: Samples, volume: float, pan: float, loop: bool = False) -> Sounding:
        if not 0 <= float(volume) <= 1 or not -1 <= float(pan) <= 1:
            raise NaoqiError("cannot play: volume in 0..1, pan in -1..1")
        gain = self.__echo * self.__master * float(volume)
        return self.__mixer.add(Sounding(samples, gain, loop, loudspeaker=True))

    def __wait(self, sounding: Sounding) -> None:
        with self.__lock:
            self.__playing.add(sounding)
        try:
            sounding.done.result()
        finally:
            with self.__lock:
                self.__playing.discard(sounding)
