"""What the simulated robot's camera sees from anywhere in its room, without a running simulator: its renderer, in this process."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rapp_nao_sim.world import room as rooms
from rapp_nao_sim.world.body import Body
from rapp_nao_sim.world.bullet import connect
from rapp_nao_sim.world.cameras import BGR, SIZES, defaults
from rapp_nao_sim.world.frames import ROBOT, WORLD, Stance, gaze, transform
from rapp_nao_sim.world.postures import load
from rapp_nao_sim.world.renderer import Renderer
from rapp_nao_sim.world.things import things

Image = NDArray[np.uint8]
Point = tuple[float, float, float]
VGA, QUAD_VGA = 2, 3
LEAN = 0.1  # rad that the torso leans ahead in StandInit
UP = (-math.sin(LEAN), 0.0, math.cos(LEAN))


class _NoService:
    """The renderer's line to a parent, of which there is none."""

    def offer(self, handlers: Mapping[str, Callable[..., Any]]) -> None:
        """Take none."""


class RenderedRoom:
    """The robot stands as it does after walking, and turns its head as rapp_look_at_point does."""

    def __init__(self, room: rooms.Room | None = None) -> None:
        self.room = room or rooms.load()
        self._renderer = Renderer(_NoService())  # type: ignore[arg-type]
        self._renderer._set_up(self.room)
        self._body = Body(connect(), looks=False)
        self._angles = dict(load()["StandInit"].angles)
        self._places = {name: thing.home if thing.placed else None for name, thing in things(self.room).items()}

    def picture(
        self,
        stand: tuple[float, float, float],
        look: Point | None = None,
        door: float | None = None,
        lamp: float | None = None,
        resolution: int = VGA,
        head: tuple[float, float] = (0.0, 0.0),
    ) -> Image:
        """Blue, green, red of what is seen from x, y, theta when looking at a point of the room, or with the head so."""
        angles = self._turned(self.gaze(stand, look) if look else head)
        lean = (0.0, math.sin(LEAN / 2), 0.0, math.cos(LEAN / 2))
        turn = (0.0, 0.0, math.sin(stand[2] / 2), math.cos(stand[2] / 2))
        self._body.put(angles, _times(turn, lean), stand[:2])
        position, orientation = self._body.base()
        state = {
            "angles": angles,
            "position": position,
            "orientation": orientation,
            "door": self.room.door.angle if door is None else door,
            "lamp": self.room.light.lamp if lamp is None else lamp,
            "places": self._places,
        }
        data, _ = self._renderer._shot(state, 0, resolution, defaults(), BGR)
        width, height = SIZES[resolution]
        return np.frombuffer(data, np.uint8).reshape(height, width, 3)

    def gaze(self, stand: tuple[float, float, float], look: Point) -> tuple[float, float]:
        """HeadYaw and HeadPitch that bring a point of the room into the picture's middle."""
        torso = transform("Torso", WORLD, Stance(self._angles, UP, stand))
        return gaze((np.linalg.inv(torso) @ [*look, 1.0])[:3].tolist())

    def camera(self, head: tuple[float, float]) -> NDArray[np.float64]:
        """The top camera in the robot's frame, as rapp_get_transform gives it."""
        return transform("CameraTop", ROBOT, Stance(self._turned(head), UP, (0.0, 0.0, 0.0)))

    def _turned(self, head: tuple[float, float]) -> dict[str, float]:
        return self._angles | dict(zip(("HeadYaw", "HeadPitch"), head, strict=True))


def _times(a: Any, b: Any) -> tuple[float, float, float, float]:
    (x1, y1, z1, w1), (x2, y2, z2, w2) = a, b
    return (
        w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
        w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
        w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
    )
