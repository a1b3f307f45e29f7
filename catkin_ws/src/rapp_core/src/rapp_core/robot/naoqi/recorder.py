"""Virtual receptor r_mic on ALAudioRecorder and ALAudioDevice (paper Fig. 7)."""

from pathlib import Path

from rapp_core.robot.naoqi.connection import Connection

RATE = 16_000  # Hz; NAOqi records ogg from the front microphone at this rate only
FRONT = [0, 0, 1, 0]  # left, right, front, rear


class NaoqiRecorder:
    """Records the front microphone; start and stop are asynchronous calls whose outcome is still looked at."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def start(self, path: Path) -> None:
        """See `ports.Recorder`. A recording that an earlier core agent left running is ended first."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._connection.call("ALAudioRecorder", "stopMicrophonesRecording")
        self._connection.call("ALAudioRecorder", "startMicrophonesRecording", str(path), "ogg", RATE, FRONT)

    def stop(self) -> None:
        """See `ports.Recorder`."""
        self._connection.call("ALAudioRecorder", "stopMicrophonesRecording")

    def energy(self) -> float:
        """See `ports.Recorder`."""
        return float(self._connection.call("ALAudioDevice", "getFrontMicEnergy"))
