"""The renderer process: pictures of a mirrored world, while the physics goes on in its own process.

Started by WorldClient as `python -m rapp_nao_sim.world.renderer FD` when the first picture is asked for.
"""

import math
import sys
from typing import Any

import cv2
import numpy as np

from rapp_nao_sim.world.body import Body
from rapp_nao_sim.world.bullet import connect
from rapp_nao_sim.world.room import Room
from rapp_nao_sim.world.scene import Scene
from rapp_nao_sim.world.worker import Service, serve

FINER = 2  # times as many pixels are drawn in each direction, and averaged: smooth edges
NEAR, FAR = 0.05, 20.0  # m, what the camera sees


class Renderer:
    """Draws what the physics process says is there."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._bullet = connect()
        service.offer({"set_up": self._set_up, "overview": self._overview})

    def run(self) -> None:
        """Answer until the parent leaves."""
        while True:
            self._service.handle()

    def _set_up(self, room: Room) -> None:
        self._room = room
        self._scene = Scene(self._bullet, room, pictures=True)
        self._body = Body(self._bullet, looks=True)

    def _overview(self, state: dict[str, Any], width: int, height: int) -> bytes:
        """The room from its overview camera, as PNG."""
        bullet, view = self._bullet, self._room.overview
        self._body.mirror(state["angles"], state["position"], state["orientation"])
        self._scene.set_door(state["door"])
        self._scene.set_lamp(state["lamp"])
        lamp = state["lamp"]
        _, _, pixels, _, _ = bullet.getCameraImage(
            width * FINER,
            height * FINER,
            bullet.computeViewMatrix(view.eye, view.target, (0, 0, 1)),
            bullet.computeProjectionMatrixFOV(math.degrees(view.field_of_view), width / height, NEAR, FAR),
            lightDirection=self._room.light.direction,
            lightColor=(1.0, 0.97, 0.90),
            lightDistance=6,
            lightAmbientCoeff=0.22 + 0.42 * lamp,
            lightDiffuseCoeff=0.16 + 0.36 * lamp,
            lightSpecularCoeff=0.06,
            shadow=1,
            renderer=bullet.ER_TINY_RENDERER,
            flags=bullet.ER_NO_SEGMENTATION_MASK,
        )
        image = np.reshape(np.asarray(pixels, np.uint8), (height * FINER, width * FINER, 4))[:, :, 2::-1]
        small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
        _, png = cv2.imencode(".png", small, [cv2.IMWRITE_PNG_COMPRESSION, 9])
        return png.tobytes()


if __name__ == "__main__":
    sys.exit(serve(lambda service: Renderer(service).run, sys.argv))
