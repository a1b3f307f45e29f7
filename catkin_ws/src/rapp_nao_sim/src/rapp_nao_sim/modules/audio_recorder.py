"""ALAudioRecorder on the room's microphone."""

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import qi
import soundfile

from rapp_nao_sim.files import Files
from rapp_nao_sim.naoqi import Module, NaoqiError, working
from rapp_nao_sim.sound.room import Block, Room
from rapp_nao_sim.sound.samples import RATE

FORMATS = {"wav": ("WAV", "PCM_16"), "ogg": ("OGG", "VORBIS")}


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
        if kind not in FORMATS:
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
            container, subtype = FORMATS[kind]
            try:
                self.__file = soundfile.SoundFile(path, "w", RATE, count, format=container, subtype=subtype)
            except (soundfile.LibsndfileError, OSError) as error:
                raise NaoqiError(f"cannot write {name}: {error}") from error
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
