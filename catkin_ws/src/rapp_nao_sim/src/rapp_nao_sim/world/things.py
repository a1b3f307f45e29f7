"""The things of a room that can be moved: of which parts they are made, and where the parts are when a thing is put somewhere."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from rapp_nao_sim.world.room import Box, Cylinder, Person, Picture, Room

Place = tuple[float, float, float, float]
"""x, y, z in m and a turn about z in rad."""

Shape = Box | Cylinder | Picture

_TROUSERS, _SKIN, _HAIR = (0.22, 0.23, 0.27), (0.80, 0.66, 0.54), (0.16, 0.12, 0.10)


@dataclass(frozen=True)
class Part:
    """A shape and where it is while its thing is at home."""

    shape: Shape
    place: Place


@dataclass(frozen=True)
class Thing:
    """What has a name: its parts, its place in the room file, and whether it is there at the start."""

    name: str
    kind: str  # box, cylinder, picture or person: of its first part
    parts: tuple[Part, ...]
    home: Place
    placed: bool
    voice: str = ""  # of a person

    def at(self, place: Place) -> list[Place]:
        """Where each part is with the thing at a place."""
        turn = place[3] - self.home[3]
        cos, sin = math.cos(turn), math.sin(turn)
        result = []
        for part in self.parts:
            x, y, z = (part.place[i] - self.home[i] for i in range(3))
            result.append((place[0] + cos * x - sin * y, place[1] + sin * x + cos * y, place[2] + z, part.place[3] + turn))
        return result


def things(room: Room) -> dict[str, Thing]:
    """All things of a room by name."""
    found: dict[str, Thing] = {}
    shapes: list[Shape] = [*room.boxes, *room.cylinders, *room.pictures]
    for shape in shapes:
        kind, turn = _kind(shape)
        part = Part(shape, (*shape.centre, turn))
        known = found.get(shape.name)
        if known is None:
            found[shape.name] = Thing(shape.name, kind, (part,), part.place, shape.placed)
        else:
            found[shape.name] = replace(known, parts=(*known.parts, part))
    return found | {person.name: _somebody(person) for person in room.people}


def _kind(shape: Shape) -> tuple[str, float]:
    match shape:
        case Box():
            return "box", shape.yaw
        case Cylinder():
            return "cylinder", 0.0
        case Picture():
            return "picture", shape.facing


def _somebody(person: Person) -> Thing:
    home = (*person.place, 0.0, person.facing)
    return Thing(person.name, "person", tuple(_limbs(person, home)), home, person.placed, person.voice)


def _limbs(person: Person, home: Place) -> Iterator[Part]:
    """Trousers, shirt, neck, and a head as high as broad with a face bent round its front."""
    x, y, _, facing = home
    head = 0.2 * person.height
    bottom = person.height - head
    for low, high, radius, colour in (
        (0.0, 0.45 * person.height, 0.5 * head, _TROUSERS),
        (0.45 * person.height, bottom - 0.05, 0.6 * head, person.colour),
        (bottom - 0.05, bottom, 0.2 * head, _SKIN),
        (bottom, person.height, 0.45 * head, _HAIR),
    ):
        centre = (x, y, (low + high) / 2)
        yield Part(Cylinder(person.name, radius, high - low, centre, colour), (*centre, facing))
    radius = 0.46 * head
    front = (x + radius * math.cos(facing), y + radius * math.sin(facing), bottom + head / 2)
    yield Part(Picture(person.name, "head", front, facing, (head, head), bend=radius), (*front, facing))
