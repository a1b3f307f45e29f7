"""ALAudioRecorder, ALAudioDevice and ALAudioPlayer on the room's microphone and loudspeaker."""

import logging
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import qi
import soundfile

from rapp_nao_sim.files import Files
from rapp_nao_sim.naoqi import Module, NaoqiError, working
from rapp_nao_sim.sound.endpointer import energy
from rapp_nao_sim.sound.room import Block, Mixer, Room, Sounding
from rapp_nao_sim.sound.synthesis import RATE, resample

_log = logging.getLogger(__name__)
ENERGY_GAIN = 8.0  # puts the room's noise below 1700 and speech above, where the deliverable has its limit
PERIOD = 2730  # samples: 170 ms, NAOqi's period of audio


@qi.multiThreaded()
class ALAudioRecorder(Module):
    """Records the microphones into a file."""

    def __init__(self, room: Room, files: Files) -> None:
        self.__room = room
        self.__files = files
        self.__lock = threading.Lock()
        self.__file: Any = None
        self.__end: list[Callable[[], None]] = []

    @working
    def startMicrophonesRecording(self, name: str, kind: str, rate: int, channels: list[int]) -> None:  # noqa: N802
        """Record into "wav" or "ogg" at `rate` Hz from [left, right, front, rear]; ogg: the front one at 16 kHz."""
        if kind not in ("wav", "ogg"):
            raise NaoqiError(f"cannot record {kind}: wav and ogg are known")
        if int(rate) != RATE:
            raise NaoqiError(f"cannot record at {rate} Hz: the simulated microphones work at {RATE} Hz")
        count = sum(1 for channel in channels if channel)
        if not count or len(channels) != 4 or (kind == "ogg" and count != 1):
            raise NaoqiError("cannot record these channels: choose of [left, right, front, rear], for ogg just one")
        path = self.__files.writable(name)
        with self.__lock:
            if self.__file is not None:
                raise NaoqiError("cannot record: a recording is running already")
            subtype = {"wav": ("WAV", "PCM_16"), "ogg": ("OGG", "VORBIS")}[kind]
            self.__file = soundfile.SoundFile(path, "w", RATE, count, format=subtype[0], subtype=subtype[1])
            self.__end.append(self.__room.listen(self.__writer(self.__file, count)))

    def __writer(self, file: Any, count: int) -> Callable[[Block], None]:
        def write(block: Block) -> None:
            with self.__lock:
                if not file.closed:
                    file.write(np.repeat(block[:, None], count, axis=1) if count > 1 else block)

        return write

    @working
    def stopMicrophonesRecording(self) -> None:  # noqa: N802
        """End the recording; the file is complete then. No error when none runs."""
        with self.__lock:
            file, self.__file = self.__file, None
            while self.__end:
                self.__end.pop()()
            if file is not None:
                file.close()


@qi.multiThreaded()
class ALAudioDevice(Module):
    """Energy of the microphones, volume of the loudspeaker, and samples for modules of clients."""

    def __init__(self, room: Room, fetch: Callable[[str], Any]) -> None:
        self.__fetch = [fetch]
        self.__room = room
        self.__volume = 100
        self.__level = 0.0
        self.__recent: list[Block] = []
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
        return self.__level * ENERGY_GAIN

    def setOutputVolume(self, volume: int) -> None:  # noqa: N802
        """Volume in percent."""
        self.__volume = min(100, max(0, int(volume)))

    def getOutputVolume(self) -> int:  # noqa: N802
        """Volume in percent."""
        return self.__volume

    def setClientPreferences(self, _name: str, rate: int, channels: int, _deinterleaved: int) -> None:  # noqa: N802
        """What a client's module will be given: one channel at 16 kHz is what there is."""
        if int(rate) != RATE or int(channels) not in (1, 2, 3, 4):
            raise NaoqiError(f"ALAudioDevice::setClientPreferences\n\tonly single channels at {RATE} Hz are simulated")

    @working
    def subscribe(self, name: str) -> None:
        """Call `name`.processRemote(channels, samples, [s, us], raw) every 170 ms."""
        service = self.__fetch[0](name)
        waiting: list[Block] = []

        def give(block: Block) -> None:
            waiting.append(block)
            if sum(map(len, waiting)) >= PERIOD:
                samples = np.concatenate(waiting)
                waiting.clear()
                service.call("processRemote", 1, len(samples), [0, 0], samples.tobytes(), _async=True)

        self.__clients[name] = self.__room.listen(give)

    def unsubscribe(self, name: str) -> None:
        """End subscribe."""
        end = self.__clients.pop(name, None)
        if end is not None:
            end()


@qi.multiThreaded()
class ALAudioPlayer(Module):
    """Plays files through the loudspeaker."""

    def __init__(self, mixer: Mixer, echo: float) -> None:
        self.__mixer = mixer
        self.__echo = echo
        self.__lock = threading.Lock()
        self.__playing: dict[int, Sounding] = {}
        self.__next = 0
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
        return len(self.__load(name)) / RATE

    def stopAll(self) -> None:  # noqa: N802
        """Stop all that plays."""
        with self.__lock:
            playing = list(self.__playing.values())
        for sounding in playing:
            self.__mixer.stop(sounding)

    def setMasterVolume(self, volume: float) -> None:  # noqa: N802
        """Volume from 0 to 1 of all that is played from now on."""
        self.__master = min(1.0, max(0.0, float(volume)))

    def __load(self, name: str) -> np.ndarray[Any, np.dtype[np.float32]]:
        if not Path(name).is_file():
            raise NaoqiError(f"cannot play {name}: there is no such file")
        try:
            samples, rate = soundfile.read(name, dtype="float64", always_2d=True)
        except soundfile.LibsndfileError as error:
            raise NaoqiError(f"cannot play {name}: {error}") from error
        return resample(samples.mean(axis=1), rate, RATE)

    def __play(self, name: str, position: float, volume: float, pan: float, loop: bool) -> None:
        samples = self.__load(name)
        start = round(float(position) * RATE)
        if not 0 <= start < max(1, len(samples)) or not 0 <= float(volume) <= 1 or not -1 <= float(pan) <= 1:
            raise NaoqiError("cannot play: position must lie in the file, volume in 0..1, pan in -1..1")
        gain = self.__echo * self.__master * float(volume)
        sounding = self.__mixer.add(Sounding(samples[start:] if not loop else samples, gain, loop))
        with self.__lock:
            self.__next += 1
            number = self.__next
            self.__playing[number] = sounding
        try:
            sounding.done.result()
        finally:
            with self.__lock:
                del self.__playing[number]
