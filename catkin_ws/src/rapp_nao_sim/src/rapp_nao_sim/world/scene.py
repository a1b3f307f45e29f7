"""The room in a pybullet world: built alike by the physics (solid, plain) and by the renderer (with pictures)."""

import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rapp_nao_sim.world.room import Box, Cylinder, Floor, Picture, Room, Wall
from rapp_nao_sim.world.things import Place, Shape, things

_Quaternion = tuple[float, float, float, float]
_SHADE = 0.35  # share of its colour that an unlit lampshade shows
_AWAY = -50.0  # m: the height of what is not in the room, out of every camera's sight
_STRIPS = 12  # of a bent picture


class Scene:
    """The room's bodies; the door turns, the lamp's shade brightens, things come, move and go."""

    def __init__(self, bullet: Any, room: Room, pictures: bool) -> None:
        self._bullet = bullet
        self._room = room
        self._pictures = pictures
        self._built: list[int] = []
        self._shades: list[tuple[int, Cylinder]] = []
        self._walls = [self._wall(wall) for wall in room.walls]
        self._floor(room.floor)
        door = room.door
        half = (door.width / 2, door.thickness / 2, door.height / 2)
        self._leaf = self._solid("box", half, (0, 0, 0), 0, door.colour)
        knob = bullet.createVisualShape(bullet.GEOM_SPHERE, radius=0.024, rgbaColor=(0.75, 0.72, 0.66, 1))
        self._knobs = [self._body(-1, knob, (0, 0, 0), 0) for _ in range(2)]
        self._things = things(room)
        self._parts = {name: [self._part(part.shape) for part in thing.parts] for name, thing in self._things.items()}
        self._places: dict[str, Place | None] = {}
        self.set_door(door.angle)
        self.set_lamp(room.light.lamp)
        self.arrange({name: thing.home if thing.placed else None for name, thing in self._things.items()})

    def close(self) -> None:
        """Take all of the room out of the world."""
        for body in self._built:
            self._bullet.removeBody(body)

    def names(self) -> dict[int, str]:
        """What the solid bodies but the floor are called: "wall", "door", or as the thing they are part of."""
        found = dict.fromkeys(self._walls, "wall") | {self._leaf: "door"}
        return found | {body: name for name, bodies in self._parts.items() for body in bodies if body is not None}

    def set_door(self, angle: float) -> list[int]:
        """Turn the door's leaf to an opening angle, rad; gives what has moved."""
        door = self._room.door
        yaw = door.closed + angle
        along, across = (math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw))
        x, y = (door.hinge[i] + along[i] * door.width / 2 for i in (0, 1))
        self._put(self._leaf, (x, y, door.height / 2), yaw)
        for knob, side in zip(self._knobs, (-1, 1), strict=True):
            x, y = (door.hinge[i] + along[i] * door.width * 0.9 + side * across[i] * (door.thickness / 2 + 0.02) for i in (0, 1))
            self._put(knob, (x, y, door.height * 0.48), yaw)
        return [self._leaf]

    def set_lamp(self, level: float) -> None:
        """Show the lamp at a level from 0 to 1."""
        share = _SHADE + (1 - _SHADE) * level
        for body, shade in self._shades:
            self._bullet.changeVisualShape(body, -1, rgbaColor=(*(part * share for part in shade.colour), 1))

    def arrange(self, places: Mapping[str, Place | None]) -> None:
        """Put every thing at its place; None: out of the room."""
        for name, place in places.items():
            if self._places.get(name, ()) != place:
                self.move(name, place)

    def move(self, name: str, place: Place | None) -> list[int]:
        """Put a thing at a place or, with None, out of the room; gives what has moved."""
        thing = self._things[name]
        for body, (x, y, z, yaw) in zip(self._parts[name], thing.at(place or thing.home), strict=True):
            if body is not None:
                self._put(body, (x, y, z if place else _AWAY), yaw)
        self._places[name] = place
        return [body for body in self._parts[name] if body is not None]

    def _put(self, body: int, position: Sequence[float], yaw: float) -> None:
        self._bullet.resetBasePositionAndOrientation(body, position, self._turned(yaw))

    def _turned(self, yaw: float) -> _Quaternion:
        quaternion: _Quaternion = self._bullet.getQuaternionFromEuler((0, 0, yaw))
        return quaternion

    def _body(self, shape: int, visual: int, centre: Sequence[float], yaw: float) -> int:
        body: int = self._bullet.createMultiBody(0, shape, visual, centre, self._turned(yaw))
        self._built.append(body)
        return body

    def _solid(self, kind: str, size: Sequence[float], centre: Sequence[float], yaw: float, colour: Sequence[float]) -> int:
        bullet, look = self._bullet, {"rgbaColor": (*colour, 1), "specularColor": (0.1, 0.1, 0.1)}
        if kind == "box":
            shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=size)
            visual = bullet.createVisualShape(bullet.GEOM_BOX, halfExtents=size, **look)
        else:
            shape = bullet.createCollisionShape(bullet.GEOM_CYLINDER, radius=size[0], height=size[1])
            visual = bullet.createVisualShape(bullet.GEOM_CYLINDER, radius=size[0], length=size[1], **look)
        return self._body(shape, visual, centre, yaw)

    def _wall(self, wall: Wall) -> int:
        (x0, y0), (x1, y1) = wall.start, wall.end
        half = (math.dist(wall.start, wall.end) / 2, wall.thickness / 2, wall.height / 2)
        centre = ((x0 + x1) / 2, (y0 + y1) / 2, wall.bottom + wall.height / 2)
        return self._solid("box", half, centre, math.atan2(y1 - y0, x1 - x0), wall.colour)

    def _part(self, shape: Shape) -> int | None:
        """The body of a part, not yet at its place; the physics needs none for a picture."""
        match shape:
            case Box():
                return self._solid("box", [edge / 2 for edge in shape.size], shape.centre, shape.yaw, shape.colour)
            case Cylinder():
                body = self._solid("cylinder", (shape.radius, shape.height), shape.centre, 0, shape.colour)
                if shape.lamp:
                    self._shades.append((body, shape))
                return body
            case Picture():
                return self._picture(shape) if self._pictures else None

    def _floor(self, floor: Floor) -> None:
        bullet = self._bullet
        if not self._pictures:
            # Endless: who walks or is pushed out of the room does not fall for ever.
            plane = self._body(bullet.createCollisionShape(bullet.GEOM_PLANE), -1, (0, 0, 0), 0)
            bullet.changeDynamics(plane, -1, lateralFriction=0.9)
            return
        (width, depth), (x, y) = floor.size, floor.centre
        corners = [(x + i * width / 2, y + j * depth / 2, 0.0) for i, j in ((-1, -1), (-1, 1), (1, -1), (1, 1))]
        repeats = [(cx / floor.tile, cy / floor.tile) for cx, cy, _ in corners]
        self._textured(floor.picture, "", corners, repeats, [(0, 0, 1)] * 4)

    def _picture(self, picture: Picture) -> int:
        """Facing along x about the origin, in columns from its left edge to its right one."""
        width, height = picture.size
        count = _STRIPS if picture.bend > 0 else 1
        shares = [column / count for column in range(count + 1)]
        corners, repeats, normals = [], [], []
        for share in shares:
            y, x, turn = (share - 0.5) * width, 0.0, 0.0
            if picture.bend > 0:
                turn = y / picture.bend
                x, y = picture.bend * (math.cos(turn) - 1), picture.bend * math.sin(turn)
            corners += [(x, y, -height / 2), (x, y, height / 2)]
            repeats += [(share, 0.0), (share, 1.0)]
            normals += [(math.cos(turn), math.sin(turn), 0.0)] * 2
        return self._textured(picture.kind, picture.text, corners, repeats, normals)

    def _textured(
        self,
        kind: str,
        text: str,
        corners: Sequence[Sequence[float]],
        repeats: Sequence[Sequence[float]],
        normals: Sequence[Sequence[float]],
    ) -> int:
        """A picture on a strip of rectangles; `corners` lie in pairs, one pair for each edge across the strip."""
        import cv2  # only the renderer hangs pictures

        from rapp_nao_sim.world.pictures import paint

        bullet = self._bullet
        indices = [start + step for start in range(0, len(corners) - 2, 2) for step in (0, 2, 3, 0, 3, 1)]
        visual = bullet.createVisualShape(
            bullet.GEOM_MESH, vertices=corners, indices=indices, uvs=repeats, normals=normals, rgbaColor=(1, 1, 1, 1)
        )
        body = self._body(-1, visual, (0, 0, 0), 0)
        with tempfile.TemporaryDirectory(prefix="rapp-picture-") as folder:
            path = Path(folder) / "picture.png"
            cv2.imwrite(str(path), paint(kind, text))
            bullet.changeVisualShape(body, -1, textureUniqueId=bullet.loadTexture(str(path)))
        return body
