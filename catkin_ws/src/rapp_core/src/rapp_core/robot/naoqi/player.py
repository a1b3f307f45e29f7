"""Virtual effector e_ls on ALAudioPlayer."""

from pathlib import Path

from rapp_core.robot.naoqi.connection import Connection

LONGEST = 3600.0  # s of one file that is waited for


class NaoqiPlayer:
    """Plays files through the loudspeaker."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def play(self, path: Path, position: float, volume: float, balance: float) -> None:
        """See `ports.Player`."""
        arguments = (str(path), position, volume, balance)
        self._connection.call("ALAudioPlayer", "playFileFromPosition", *arguments, timeout=LONGEST)

    def loop(self, path: Path, volume: float, balance: float) -> None:
        """See `ports.Player`."""
        self._connection.start("ALAudioPlayer", "playFileInLoop", str(path), volume, balance)

    def stop(self) -> None:
        """See `ports.Player`."""
        self._connection.call("ALAudioPlayer", "stopAll")
