"""Pictures of the world for whoever asks: the renderer's process, started when first needed and anew when it has died."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rapp_nao_sim.world.cameras import Settings
from rapp_nao_sim.world.errors import Unreachable
from rapp_nao_sim.world.room import Room
from rapp_nao_sim.world.worker import Worker

RENDER_TIMEOUT = 30.0  # s


@dataclass(frozen=True)
class Shot:
    """What a camera of the robot saw."""

    data: bytes
    exposure: float  # times the normal one
    when: float  # s since 1970


class Views:
    """Draws what `look` tells of the world; one picture at a time, callable from any thread."""

    def __init__(self, look: Callable[[], dict[str, Any]], alive: Callable[[], bool]) -> None:
        self._look = look
        self._alive = alive  # whether there is a world to look at
        self._renderer = Worker("rapp_nao_sim.world.renderer")
        self._lock = threading.Lock()
        self._room: Room | None = None

    def show(self, prepare: Callable[[], Room]) -> None:
        """Draw another room from now on: no picture is begun while it is prepared."""
        with self._lock:
            self._room = prepare()
            self._renderer.close()

    def scenery(self) -> tuple[Room, dict[str, Any]]:
        """The room and what is where in it."""
        with self._lock:
            if self._room is None:
                raise Unreachable("cannot look at the room: the world has not been started")
            return self._room, self._look()

    def close(self) -> None:
        """End the renderer and wait for it."""
        self._renderer.close()

    def overview(self, width: int, height: int) -> bytes:
        """The room from its overview camera as PNG."""
        with self._lock:
            png: bytes = self._draw("overview", self._look(), width, height)
        return png

    def shot(self, camera: int, resolution: int, settings: Settings, colour: int) -> Shot:
        """What the robot's camera sees now."""
        with self._lock:
            state, when = self._look(), time.time()
            data, exposure = self._draw("shot", state, camera, resolution, dict(settings), colour)
        return Shot(data, exposure, when)

    def _draw(self, verb: str, *args: Any) -> Any:
        try:
            return self._ask(verb, *args)
        except Unreachable:
            if not self._alive():
                raise
            self._renderer.close()
            return self._ask(verb, *args)  # of a new process, once

    def _ask(self, verb: str, *args: Any) -> Any:
        if not self._renderer.alive():
            self._renderer.close()
            self._renderer.start()
            self._renderer.call("set_up", self._room, timeout=RENDER_TIMEOUT)
        return self._renderer.call(verb, *args, timeout=RENDER_TIMEOUT)
