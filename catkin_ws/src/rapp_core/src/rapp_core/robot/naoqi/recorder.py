"""Virtual receptor r_mic on ALAudioRecorder and ALAudioDevice (paper Fig. 7)."""

from pathlib import Path
from typing import Any

from rapp_core.robot.naoqi.connection import Connection

MODULE, START, STOP = "ALAudioRecorder", "startMicrophonesRecording", "stopMicrophonesRecording"
RATE = 16_000  # Hz; NAOqi records ogg from the front microphone at this rate only
FRONT = [0, 0, 1, 0]  # left, right, front, rear


class NaoqiRecorder:
    """Records the front microphone; start and stop are asynchronous calls whose outcome is looked at later."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._starting: Any = None  # future of startMicrophonesRecording

    def start(self, path: Path) -> None:
        """See `ports.Recorder`. A recording that an earlier core agent left running is ended first."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._connection.call(MODULE, STOP)
        self._starting = self._connection.start(MODULE, START, str(path), "ogg", RATE, FRONT)

    def check(self) -> None:
        """See `ports.Recorder`."""
        if self._starting is not None and self._starting.isFinished():
            self._started()

    def stop(self) -> None:
        """See `ports.Recorder`."""
        stopping = self._connection.start(MODULE, STOP)
        try:
            self._started()
        finally:
            self._connection.result(stopping, MODULE, STOP)

    def _started(self) -> None:
        starting, self._starting = self._starting, None
        if starting is not None:
            self._connection.result(starting, MODULE, START)

    def energy(self) -> float:
        """See `ports.Recorder`."""
        return float(self._connection.call("ALAudioDevice", "getFrontMicEnergy"))
