"""ALAudioPlayer through the room's loudspeaker."""

import threading
from pathlib import Path

import qi

from rapp_nao_sim.naoqi import Module, NaoqiError, quick, working
from rapp_nao_sim.sound.room import Mixer, Sounding
from rapp_nao_sim.sound.samples import RATE, load


@qi.multiThreaded()
class ALAudioPlayer(Module):
    """Plays files through the loudspeaker."""

    def __init__(self, mixer: Mixer, echo: float) -> None:
        self.__mixer = mixer
        self.__echo = echo
        self.__lock = threading.Lock()
        self.__playing: set[Sounding] = set()
        self.__master = 1.0

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

    def __play(self, name: str, position: float, volume: float, pan: float, loop: bool) -> None:
        samples = load(Path(name))
        start = round(float(position) * RATE)
        if not 0 <= start < max(1, len(samples)) or not 0 <= float(volume) <= 1 or not -1 <= float(pan) <= 1:
            raise NaoqiError("cannot play: position must lie in the file, volume in 0..1, pan in -1..1")
        gain = self.__echo * self.__master * float(volume)
        sounding = self.__mixer.add(Sounding(samples[start:], gain, loop))
        with self.__lock:
            self.__playing.add(sounding)
        try:
            sounding.done.result()
        finally:
            with self.__lock:
                self.__playing.discard(sounding)
