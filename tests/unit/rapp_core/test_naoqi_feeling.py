"""The sonars of NAOqi, which work for who has subscribed: two threads that want them, and do not."""

import threading
from types import SimpleNamespace
from typing import Any

from rapp_core.robot.naoqi.feeling import NaoqiFeeling


class Robot:
    """Notes what its sonars are told; while they are told to be quiet, another thread wakes them."""

    present = True

    def __init__(self) -> None:
        self.told: list[str] = []
        self.feeling = NaoqiFeeling(self, "core")  # type: ignore[arg-type]
        self.other = threading.Thread(target=self.senses)
        self._sonar = SimpleNamespace()

    def senses(self) -> None:
        """What follows the waking does not matter here."""
        self.feeling._wake()

    def service(self, _module: str) -> Any:
        """See `Connection`."""
        return self._sonar

    def call(self, _module: str, method: str, *_args: Any) -> Any:
        """See `Connection`."""
        if method == "unsubscribe":
            self.other.start()
            self.other.join(0.5)  # it has the time to be first, if it may
        self.told.append(method)
        return []


def test_sonars_that_are_woken_while_they_are_told_to_be_quiet_are_awake() -> None:
    robot = Robot()
    robot.senses()
    robot.told.clear()
    robot.feeling.close()
    robot.other.join(10)
    assert [method for method in robot.told if method.endswith("subscribe")] == ["unsubscribe", "subscribe"]
