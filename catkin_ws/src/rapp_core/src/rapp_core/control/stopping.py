"""A hand on the robot's head stops the RApp that runs."""

import logging
import threading

from rapp_core.body_ports import Feeling
from rapp_core.errors import CoreError

PERIOD = 0.1  # s between two looks
RETRY = 1.0  # s until a robot that is away is asked again

_log = logging.getLogger(__name__)


class Touch:
    """Asks in a thread of its own, for NAOqi may take its time, and the lease is to be watched meanwhile."""

    def __init__(self, feeling: Feeling) -> None:
        self._feeling = feeling
        self._felt, self._over = threading.Event(), threading.Event()

    @property
    def felt(self) -> bool:
        """Whether the head was touched since `begin`."""
        return self._felt.is_set()

    def begin(self) -> None:
        """A RApp begins: feel from now on."""
        self.end()
        self._felt, self._over = threading.Event(), threading.Event()
        threading.Thread(target=self._feel, args=(self._felt, self._over), name="touch", daemon=True).start()

    def end(self) -> None:
        """It has ended."""
        self._over.set()

    def _feel(self, felt: threading.Event, over: threading.Event) -> None:
        while not over.wait(PERIOD):
            try:
                if self._feeling.touched():
                    felt.set()
                    return
            except CoreError as error:
                _log.info("%s", error)
                over.wait(RETRY)
