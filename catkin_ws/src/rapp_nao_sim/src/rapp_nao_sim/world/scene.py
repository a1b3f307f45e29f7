"""The room in a pybullet world: built alike by the physics (solid, plain) and by the renderer (with pictures)."""

import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rapp_nao_sim.world.room import Box, Cylinder, Picture, Room, Wall

_Quaternion = tuple[float, float, float, float]
_SHADE = 0.35  # share of its colour that an unlit lampshade shows


class Scene:
    """The room's bodies; the door turns and the lamp's shade brightens."""

    def __init__(self, bullet: Any, room: Room, pictures: bool) -> None:
        self._bullet = bullet
        self._room = room
        self._shades: list[tuple[int, Cylinder]] = []
        for wall in room.walls:
            self._wall(wall)
        for box in room.boxes:
            self._box(box)
        for cylinder in room.cylinders:
            self._cylinder(cylinder)
        self._floor(pictures)
        door = room.door
        half = (door.width / 2, door.thickness / 2, door.height / 2)
        self._leaf = self._solid("box", half, (0, 0, 0), 0, door.colour)
        knob = bullet.createVisualShape(bullet.GEOM_SPHERE, radius=0.024, rgbaColor=(0.75, 0.72, 0.66, 1))
        self._knobs = [bullet.createMultiBody(0, -1, knob) for _ in range(2)]
        self.set_door(door.angle)
        self.set_lamp(room.light.lamp)
        if pictures:
            for picture in room.pictures:
                self._picture(picture)

    def set_door(self, angle: float) -> None:
        """Turn the door's leaf to an opening angle, rad."""
        door = self._room.door
        yaw = door.closed + angle
        along, across = (math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw))
        x, y = (door.hinge[i] + along[i] * door.width / 2 for i in (0, 1))
        self._put(self._leaf, (x, y, door.height / 2), yaw)
        for knob, side in zip(self._knobs, (-1, 1), strict=True):
            x, y = (
                door.hinge[i] + along[i] * door.width * 0.9 + side * across[i] * (door.thickness / 2 + 0.02) for i in (0, 1)
            )
            self._put(knob, (x, y, door.height * 0.48), yaw)

    def set_lamp(self, level: float) -> None:
        """Show the lamp at a level from 0 to 1."""
        share = _SHADE + (1 - _SHADE) * level
        for body, shade in self._shades:
            self._bullet.changeVisualShape(body, -1, rgbaColor=(*(part * share for part in shade.colour), 1))

    def _put(self, body: int, position: Sequence[float], yaw: float) -> None:
        self._bullet.resetBasePositionAndOrientation(body, position, self._turned(yaw))

    def _turned(self, yaw: float) -> _Quaternion:
        quaternion: _Quaternion = self._bullet.getQuaternionFromEuler((0, 0, yaw))
        return quaternion

    def _solid(self, kind: str, size: Sequence[float], centre: Sequence[float], yaw: float, colour: Sequence[float]) -> int:
        bullet, look = self._bullet, {"rgbaColor": (*colour, 1), "specularColor": (0.1, 0.1, 0.1)}
        if kind == "box":
            shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=size)
            visual = bullet.createVisualShape(bullet.GEOM_BOX, halfExtents=size, **look)
        else:
            shape = bullet.createCollisionShape(bullet.GEOM_CYLINDER, radius=size[0], height=size[1])
            visual = bullet.createVisualShape(bullet.GEOM_CYLINDER, radius=size[0], length=size[1], **look)
        body: int = bullet.createMultiBody(0, shape, visual, centre, self._turned(yaw))
        return body

    def _wall(self, wall: Wall) -> None:
        (x0, y0), (x1, y1) = wall.start, wall.end
        half = (math.dist(wall.start, wall.end) / 2, wall.thickness / 2, wall.height / 2)
        centre = ((x0 + x1) / 2, (y0 + y1) / 2, wall.bottom + wall.height / 2)
        self._solid("box", half, centre, math.atan2(y1 - y0, x1 - x0), wall.colour)

    def _box(self, box: Box) -> None:
        self._solid("box", [edge / 2 for edge in box.size], box.centre, box.yaw, box.colour)

    def _cylinder(self, item: Cylinder) -> None:
        body = self._solid("cylinder", (item.radius, item.height), item.centre, 0, item.colour)
        if item.lamp:
            self._shades.append((body, item))

    def _floor(self, pictures: bool) -> None:
        bullet, floor = self._bullet, self._room.floor
        if not pictures:
            # Endless: who walks or is pushed out of the room does not fall for ever.
            plane = bullet.createMultiBody(0, bullet.createCollisionShape(bullet.GEOM_PLANE))
            bullet.changeDynamics(plane, -1, lateralFriction=0.9)
            return
        (width, depth), (x, y) = floor.size, floor.centre
        corners = [(x + i * width / 2, y + j * depth / 2, 0.0) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        repeats = [(cx / floor.tile, cy / floor.tile) for cx, cy, _ in corners]
        self._textured(floor.picture, "", corners, repeats, (0, 0, 0), 0)

    def _picture(self, picture: Picture) -> None:
        width, height = picture.size
        corners = [(0.0, i * width / 2, j * height / 2) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        repeats = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
        self._textured(picture.kind, picture.text, corners, repeats, picture.centre, picture.facing)

    def _textured(
        self,
        kind: str,
        text: str,
        corners: Sequence[Sequence[float]],
        repeats: Sequence[Sequence[float]],
        centre: Sequence[float],
        yaw: float,
    ) -> None:
        import cv2  # only the renderer hangs pictures

        from rapp_nao_sim.world.pictures import paint

        bullet = self._bullet
        normal = (0, 0, 1) if centre == (0, 0, 0) else (1, 0, 0)
        visual = bullet.createVisualShape(
            bullet.GEOM_MESH,
            vertices=corners,
            indices=[0, 1, 2, 0, 2, 3],
            uvs=repeats,
            normals=[normal] * 4,
            rgbaColor=(1, 1, 1, 1),
        )
        body = bullet.createMultiBody(0, -1, visual, centre, self._turned(yaw))
        with tempfile.TemporaryDirectory(prefix="rapp-picture-") as folder:
            path = Path(folder) / "picture.png"
            cv2.imwrite(str(path), paint(kind, text))
            bullet.changeVisualShape(body, -1, textureUniqueId=bullet.loadTexture(str(path)))
