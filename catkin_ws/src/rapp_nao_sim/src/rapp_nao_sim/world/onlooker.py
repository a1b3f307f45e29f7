"""Keeps the window of the window process showing the world."""

import logging
import os
import threading
from collections.abc import Callable, Mapping
from typing import Any

from rapp_nao_sim.world.errors import Refused, Unreachable, WorldError
from rapp_nao_sim.world.room import Room
from rapp_nao_sim.world.worker import Worker

PERIOD = 0.05  # s between two states shown
OPEN_TIMEOUT = 30.0  # s, for the window to open

_log = logging.getLogger(__name__)


class Onlooker:
    """A thread that tells the window what there is; `look` gives the room and its state."""

    def __init__(self, look: Callable[[], tuple[Room, dict[str, Any]]]) -> None:
        self._look = look
        self._window = Worker("rapp_nao_sim.world.window")
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="onlooker", daemon=True)

    def open(self, env: Mapping[str, str] = os.environ) -> None:
        """Open the window; raises Refused where there is no screen."""
        if not env.get("DISPLAY"):
            raise Refused("cannot open a window: there is no screen here (DISPLAY is not set); use --shot FILE.png instead")
        self._window.start()
        try:
            self._room, _ = self._look()
            self._window.call("set_up", self._room, timeout=OPEN_TIMEOUT)
        except Unreachable as error:
            self._window.close()
            raise Refused(
                f"cannot open a window on the screen {env['DISPLAY']}: it does not answer; set DISPLAY, or use --shot FILE.png"
            ) from error
        self._thread.start()

    def close(self) -> None:
        """Close the window."""
        self._stop.set()
        self._window.close()  # what the thread waits for fails then
        if self._thread.is_alive():
            self._thread.join(1)

    def _run(self) -> None:
        while not self._stop.wait(PERIOD):
            try:
                room, state = self._look()
                if room is not self._room:
                    self._window.call("set_up", room, timeout=OPEN_TIMEOUT)
                    self._room = room
                self._window.call("show", state)
            except WorldError as error:
                if not self._stop.is_set():
                    _log.info("the window is closed; the simulator goes on (%s)", error)
                return
