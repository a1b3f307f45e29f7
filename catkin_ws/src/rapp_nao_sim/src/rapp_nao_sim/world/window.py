"""The window process: the mirrored world in pybullet's own window, to be looked at from all sides.

Started by Onlooker as `python -m rapp_nao_sim.world.window FD`; it ends when its window is closed.
pybullet lights its window by itself: the lamp's level shows on its shade alone, otherwise only in the robot's pictures.
"""

import math
import os
import sys
from pathlib import Path
from typing import Any

from rapp_nao_sim.world.body import Body
from rapp_nao_sim.world.bullet import connect
from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.room import Room
from rapp_nao_sim.world.scene import Scene
from rapp_nao_sim.world.worker import Service, serve

LOOK = 0.2  # s between two looks whether the window is still open


class Window:
    """Shows what the physics process says is there."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._bullet = connect(window=True)
        for panel in (self._bullet.COV_ENABLE_GUI, self._bullet.COV_ENABLE_KEYBOARD_SHORTCUTS):
            self._bullet.configureDebugVisualizer(panel, 0)
        service.offer({"set_up": self._set_up, "show": self._show})

    def run(self) -> None:
        """Answer until the parent leaves or the window is closed."""
        while self._bullet.isConnected():
            if self._service.pending(LOOK):
                self._service.handle()
        raise EOFError

    def _set_up(self, room: Room) -> None:
        bullet, view = self._bullet, room.overview
        bullet.resetSimulation()
        bullet.configureDebugVisualizer(bullet.COV_ENABLE_RENDERING, 0)
        self._scene = Scene(bullet, room, pictures=True)
        self._body = Body(bullet, looks=True)
        bullet.configureDebugVisualizer(bullet.COV_ENABLE_RENDERING, 1)
        x, y, z = (target - eye for eye, target in zip(view.eye, view.target, strict=True))
        turn, tilt = math.degrees(math.atan2(y, x)) - 90, math.degrees(math.atan2(z, math.hypot(x, y)))
        bullet.resetDebugVisualizerCamera(math.dist(view.eye, view.target), turn, tilt, view.target)

    def _show(self, state: dict[str, Any]) -> None:
        if not self._bullet.isConnected():
            raise Refused("cannot show the room: the window is closed")
        self._body.mirror(state["angles"], state["position"], state["orientation"])
        self._scene.set_door(state["door"])
        self._scene.set_lamp(state["lamp"])
        self._scene.arrange(state["places"])


if __name__ == "__main__":
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 1)  # pybullet's window tells its whole life there
    serve(lambda service: Window(service).run, sys.argv)
