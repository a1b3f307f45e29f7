"""The body's senses for ALMemory: its keys read fresh, its events raised in their order."""

import logging
import threading
import time
from collections.abc import Callable, Collection, Mapping
from typing import Any

from rapp_nao_sim.world.errors import WorldError
from rapp_nao_sim.world.keys import INITIAL, values
from rapp_nao_sim.world.process import WorldClient

FRESH = 0.02  # s: NAOqi's keys are as old as this
PATIENCE = 1.5  # s for the thread to end
PAUSE = 0.5  # s before the world is asked again when it did not answer

Put = Callable[[str, Any], None]  # of a key and its value

_log = logging.getLogger(__name__)


class BodySenses:
    """Reads a world; `start` begins to raise its events."""

    def __init__(self, world: WorldClient) -> None:
        self._world = world
        self._lock = threading.Lock()
        self._values: Mapping[str, Any] = {}
        self._read = -FRESH
        self._names: frozenset[str] = frozenset()
        self._end = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, insert: Put, raise_event: Put) -> None:
        """Raise events from now on; the world runs already."""
        self._names = frozenset(self.read())
        for key, value in INITIAL.items():
            insert(key, value)
        self._thread = threading.Thread(target=self._listen, args=(raise_event,), name="body senses", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End it; the world has ended already, or answers soon."""
        self._end.set()
        if self._thread is not None:
            self._thread.join(PATIENCE)

    def names(self) -> Collection[str]:
        """The keys that `read` gives."""
        return self._names

    def read(self) -> Mapping[str, Any]:
        """All keys with their values, at most FRESH old. Raises WorldError."""
        with self._lock:
            if time.monotonic() - self._read >= FRESH:
                self._values = values(self._world.feelings())
                self._read = time.monotonic()
            return self._values

    def _listen(self, raise_event: Put) -> None:
        while not self._end.is_set():
            try:
                events = self._world.events()
            except WorldError as error:
                if not self._world.alive():
                    return
                _log.warning("cannot hear of events: %s", error)
                self._end.wait(PAUSE)
                continue
            for key, value in events:
                raise_event(key, value)
