"""The renderer process: pictures of a mirrored world, while the physics goes on in its own process.

Started by Views as `python -m rapp_nao_sim.world.renderer FD` when the first picture is asked for.
"""

import math
import sys
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from rapp_nao_sim.world.body import Body
from rapp_nao_sim.world.bullet import connect
from rapp_nao_sim.world.cameras import CAMERAS, HIGH, LINK, SIZES, WIDE, Settings
from rapp_nao_sim.world.developing import develop
from rapp_nao_sim.world.room import Room
from rapp_nao_sim.world.scene import Scene
from rapp_nao_sim.world.worker import Service, serve

FINER = 2  # times as many pixels of the overview are drawn in each direction, and averaged: smooth edges
NEAR, FAR = 0.05, 20.0  # m, what a camera sees; nearer is the robot's own head


class Stage:
    """A mirrored world: for the overview, or as the robot's own cameras see it."""

    def __init__(self, room: Room, own_view: bool) -> None:
        self._room = room
        self.bullet = connect()
        self._scene = Scene(self.bullet, room, pictures=True)
        self.body = Body(self.bullet, looks=True, own_view=own_view)

    def mirror(self, state: dict[str, Any]) -> None:
        """Be as the physics says."""
        self.body.mirror(state["angles"], state["position"], state["orientation"])
        self._scene.set_door(state["door"])
        self._scene.set_lamp(state["lamp"])
        self._scene.arrange(state["places"])
        self._lamp = state["lamp"]

    def draw(self, looking: Sequence[float], lens: Sequence[float], size: tuple[int, int], shadow: int) -> npt.NDArray[np.uint8]:
        """Red, green, blue of every pixel."""
        bullet, (width, height), lamp = self.bullet, size, self._lamp
        _, _, pixels, _, _ = bullet.getCameraImage(
            width,
            height,
            looking,
            lens,
            lightDirection=self._room.light.direction,
            lightColor=(1.0, 0.97, 0.90),
            lightDistance=6,
            lightAmbientCoeff=0.22 + 0.42 * lamp,
            lightDiffuseCoeff=0.16 + 0.36 * lamp,
            lightSpecularCoeff=0.06,
            shadow=shadow,
            renderer=bullet.ER_TINY_RENDERER,
            flags=bullet.ER_NO_SEGMENTATION_MASK,
        )
        return np.ascontiguousarray(np.reshape(np.asarray(pixels, np.uint8), (height, width, 4))[:, :, :3])


class Renderer:
    """Draws what the physics process says is there; a world is built when it is first drawn."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._stages: dict[bool, Stage] = {}
        service.offer({"set_up": self._set_up, "overview": self._overview, "shot": self._shot})

    def run(self) -> None:
        """Answer until the parent leaves."""
        while True:
            self._service.handle()

    def _set_up(self, room: Room) -> None:
        self._room = room

    def _stage(self, state: dict[str, Any], own_view: bool) -> Stage:
        stage = self._stages.get(own_view)
        if stage is None:
            stage = self._stages[own_view] = Stage(self._room, own_view)
        stage.mirror(state)
        return stage

    def _overview(self, state: dict[str, Any], width: int, height: int) -> bytes:
        """The room from its overview camera, as PNG."""
        stage, view = self._stage(state, own_view=False), self._room.overview
        bullet = stage.bullet
        looking = bullet.computeViewMatrix(view.eye, view.target, (0, 0, 1))
        lens = bullet.computeProjectionMatrixFOV(math.degrees(view.field_of_view), width / height, NEAR, FAR)
        image = stage.draw(looking, lens, (width * FINER, height * FINER), shadow=1)
        small = cv2.resize(image[:, :, ::-1], (width, height), interpolation=cv2.INTER_AREA)
        _, png = cv2.imencode(".png", small, [cv2.IMWRITE_PNG_COMPRESSION, 9])
        return png.tobytes()

    def _shot(self, state: dict[str, Any], number: int, resolution: int, settings: Settings, colour: int) -> tuple[bytes, float]:
        """What a camera of the robot sees, and its exposure; without shadows, which take three times as long."""
        stage, camera, size = self._stage(state, own_view=True), CAMERAS[number], SIZES[resolution]
        bullet, head = stage.bullet, stage.body.frame(LINK)
        tilt = bullet.getQuaternionFromEuler((0, camera.pitch, 0))
        eye, orientation = bullet.multiplyTransforms(*head, camera.offset, tilt)
        matrix = bullet.getMatrixFromQuaternion(orientation)
        ahead, up = matrix[0::3], matrix[2::3]
        looking = bullet.computeViewMatrix(eye, [place + way for place, way in zip(eye, ahead, strict=True)], up)
        lens = bullet.computeProjectionMatrixFOV(math.degrees(HIGH), math.tan(WIDE / 2) / math.tan(HIGH / 2), NEAR, FAR)
        return develop(stage.draw(looking, lens, size, shadow=0), settings, colour)


if __name__ == "__main__":
    serve(lambda service: Renderer(service).run, sys.argv)
