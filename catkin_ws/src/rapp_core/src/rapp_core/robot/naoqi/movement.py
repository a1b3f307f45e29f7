"""One motion under way on NAOqi: the future of a call that ends when the motion does."""

import threading
import time
from collections.abc import Callable
from typing import Any

from rapp_core.robot.naoqi.connection import Connection

EVERY = 0.05  # s between two looks whether a robot that was told a velocity still walks


class NaoqiMovement:
    """See `body_ports.Movement`; `halt` asks the robot to end it."""

    def __init__(self, connection: Connection, module: str, method: str, future: Any, halt: Callable[[], None]) -> None:
        self._connection = connection
        self._call = (module, method)
        self._future = future
        self._halt = halt
        self._stopped = False
        self.judge: Callable[[], bool] | None = None
        """Whether the goal of a motion that has ended is reached, where NAOqi does not tell."""

    def done(self) -> bool:
        """See `body_ports.Movement`."""
        return bool(self._future.isFinished())

    def wait(self, seconds: float) -> bool:
        """See `body_ports.Movement`."""
        self._future.wait(round(seconds * 1000))
        return self.done()

    def result(self) -> bool:
        """See `body_ports.Movement`; NAOqi answers some motions with whether they have reached their goal."""
        if self._stopped:
            return False
        if self._connection.result(self._future, *self._call) is False:
            return False
        return self.judge is None or self.judge()

    def cancel(self) -> None:
        """See `body_ports.Movement`."""
        if not self.done():
            self.note_stop()
            self._halt()

    def note_stop(self) -> None:
        """The robot is told to stop all motion, and so this one."""
        self._stopped = True


class Walking:
    """A walk with a velocity, which NAOqi only begins: it goes on until somebody ends it. See `body_ports.Movement`."""

    def __init__(self, active: Callable[[], bool], begun: Any, halt: Callable[[], None], result: Callable[[Any], Any]) -> None:
        """`begun` is the future of the call that begins it, `active` asks whether the robot walks."""
        self._active = active
        self._begun = begun
        self._halt = halt
        self._result = result
        self._halted = threading.Event()

    def done(self) -> bool:
        """See `body_ports.Movement`."""
        return bool(self._begun.isFinished()) and not self._active()

    def wait(self, seconds: float) -> bool:
        """See `body_ports.Movement`; a look at the robot costs a call, so it looks now and then, and when it is told to stop."""
        until = time.monotonic() + seconds
        self._begun.wait(round(seconds * 1000))
        while True:
            left = until - time.monotonic()
            if left > 0 and self._halted.wait(min(left, EVERY)):
                self._halted.clear()
            if self.done():
                return True
            if left <= EVERY:
                return False

    def result(self) -> bool:
        """See `body_ports.Movement`: it has no goal, so it ends by being stopped."""
        self._result(self._begun)
        return False

    def cancel(self) -> None:
        """See `body_ports.Movement`."""
        self._halted.set()
        self._halt()
