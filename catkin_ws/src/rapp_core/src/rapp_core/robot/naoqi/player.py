"""Virtual effector e_ls on ALAudioPlayer."""

from pathlib import Path
from typing import Any

from rapp_core.robot.naoqi.connection import Connection

LONGEST = 3600.0  # s of one file that is waited for
STOPS = 10
STOP_AGAIN = 100  # ms between two of them


class NaoqiPlayer:
    """Plays files through the loudspeaker."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._looping: Any = None  # libqi's future of a call that ends when the loop is stopped

    def play(self, path: Path, position: float, volume: float, balance: float) -> None:
        """See `ports.Player`."""
        arguments = (str(path), position, volume, balance)
        self._connection.call("ALAudioPlayer", "playFileFromPosition", *arguments, timeout=LONGEST)

    def loop(self, path: Path, volume: float, balance: float) -> None:
        """See `ports.Player`."""
        self._looping = self._connection.start("ALAudioPlayer", "playFileInLoop", str(path), volume, balance)

    def stop(self) -> None:
        """See `ports.Player`. A loop that was asked for just now may begin after the first stop, so it is seen to its end."""
        looping, self._looping = self._looping, None
        self._connection.call("ALAudioPlayer", "stopAll")
        for _ in range(STOPS if looping is not None else 0):
            looping.wait(STOP_AGAIN)
            if looping.isFinished():
                return
            self._connection.call("ALAudioPlayer", "stopAll")
