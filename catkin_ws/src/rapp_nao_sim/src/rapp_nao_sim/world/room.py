"""The room as described by a file: floor, walls, door, lamp, furniture, pictures, where the robot starts; m and rad."""

import math
import tomllib
from collections.abc import Iterator
from dataclasses import MISSING, Field, dataclass, field, fields
from pathlib import Path
from typing import Any

from rapp_nao_sim.world.errors import Invalid

FILE = Path(__file__).with_name("room.toml")
PICTURES = ("qr", "face", "head", "landscape", "planks")

Pair = tuple[float, float]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Floor:
    """A rectangle at height 0, tiled with a picture."""

    size: Pair
    centre: Pair = (0.0, 0.0)
    picture: str = "planks"
    tile: float = 1.0  # m


@dataclass(frozen=True)
class Light:
    """The direction the light comes from, and the lamp's level at the start."""

    direction: Triple
    lamp: float = 1.0  # 0 to 1


@dataclass(frozen=True)
class Start:
    """Where and how the robot is when the simulator starts."""

    x: float
    y: float
    theta: float
    posture: str = "Stand"


@dataclass(frozen=True)
class StartPlace:
    """Another place from which the robot may start."""

    name: str
    x: float
    y: float
    theta: float


@dataclass(frozen=True)
class Door:
    """A leaf that turns about a vertical hinge."""

    hinge: Pair
    width: float
    height: float
    thickness: float
    closed: float  # rad, direction of the closed leaf
    angle: float  # rad, opening at the start
    colour: Triple


@dataclass(frozen=True)
class Overview:
    """The camera of the overview pictures."""

    eye: Triple
    target: Triple
    field_of_view: float  # rad, vertical


@dataclass(frozen=True)
class Wall:
    """A wall between two points of its middle line."""

    start: Pair = field(metadata={"key": "from"})
    end: Pair = field(metadata={"key": "to"})
    height: float = 2.0
    thickness: float = 0.1
    colour: Triple = (0.9, 0.9, 0.9)
    bottom: float = 0.0  # m above the floor


@dataclass(frozen=True)
class Box:
    """A box with its edges' lengths.

    Boxes, cylinders and pictures with one name are one thing, moved as a whole by the first of them; not `placed`, it is not in the
    room at the start.
    """

    name: str
    size: Triple
    centre: Triple
    colour: Triple
    yaw: float = 0.0
    placed: bool = True


@dataclass(frozen=True)
class Cylinder:
    """An upright cylinder; with `lamp` its brightness follows the lamp."""

    name: str
    radius: float
    height: float
    centre: Triple
    colour: Triple
    lamp: bool = False
    placed: bool = True


@dataclass(frozen=True)
class Picture:
    """An upright picture; kind "qr" shows `text` as a QR code; bent backwards with a radius, or flat."""

    name: str
    kind: str
    centre: Triple
    facing: float  # rad, about z
    size: Pair
    text: str = ""
    bend: float = 0.0  # m
    placed: bool = True


@dataclass(frozen=True)
class Person:
    """Somebody who stands in the room and speaks with an espeak-ng voice."""

    name: str
    place: Pair
    facing: float = 0.0
    height: float = 1.2
    voice: str = "en-us+m3"
    colour: Triple = (0.20, 0.35, 0.55)  # of the shirt
    placed: bool = True


@dataclass(frozen=True)
class Room:
    """All of a room file."""

    floor: Floor
    light: Light
    robot: Start
    door: Door
    overview: Overview
    walls: tuple[Wall, ...] = ()
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    pictures: tuple[Picture, ...] = ()
    people: tuple[Person, ...] = ()
    starts: tuple[StartPlace, ...] = ()


_LISTS: dict[str, type[Any]] = {
    "walls": Wall, "boxes": Box, "cylinders": Cylinder, "pictures": Picture, "people": Person, "starts": StartPlace,
}  # fmt: skip
_TABLES: dict[str, type[Any]] = {"floor": Floor, "light": Light, "robot": Start, "door": Door, "overview": Overview}


def load(path: Path = FILE) -> Room:
    """Read a room file; raises Invalid naming the place and what is wanted there."""
    try:
        return parse(path.read_text())
    except (OSError, UnicodeDecodeError) as error:
        raise Invalid(f"cannot read the room file {path}: {error}; name another") from error
    except Invalid as error:
        raise Invalid(f"{error} (in {path})") from error


def parse(text: str) -> Room:
    """The room described by a text; raises Invalid."""
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise Invalid(f"cannot read the room: {error}; correct the file") from error
    unknown = sorted(set(tables) - set(_LISTS) - set(_TABLES))
    if unknown:
        raise Invalid(f"cannot read the room: unknown part {unknown[0]!r}; known are {', '.join([*_TABLES, *_LISTS])}")
    parts: dict[str, Any] = {name: _record(kind, tables.get(name), f"[{name}]") for name, kind in _TABLES.items()}
    for name, kind in _LISTS.items():
        entries = tables.get(name, [])
        if not isinstance(entries, list):
            raise Invalid(f"cannot read the room: {name} must be written as [[{name}]]")
        parts[name] = tuple(_record(kind, entry, f"[[{name}]] number {i + 1}") for i, entry in enumerate(entries))
    room = Room(**parts)
    _check(room)
    return room


def _record(kind: type[Any], table: Any, where: str) -> Any:
    if not isinstance(table, dict):
        raise Invalid(f"cannot read the room: {where} is missing")
    wanted = {entry.metadata.get("key", entry.name): entry for entry in fields(kind)}
    unknown = sorted(set(table) - set(wanted))
    if unknown:
        raise Invalid(f"cannot read the room: {where} has an unknown key {unknown[0]!r}; known are {', '.join(wanted)}")
    return kind(**{entry.name: _value(entry, table.get(key, MISSING), f"{key!r} of {where}") for key, entry in wanted.items()})


def _value(entry: "Field[Any]", value: Any, where: str) -> Any:
    if value is MISSING:
        if entry.default is MISSING:
            raise Invalid(f"cannot read the room: {where} is missing")
        return entry.default
    if entry.type in (str, bool):
        if not isinstance(value, entry.type):
            raise Invalid(f"cannot read the room: {where} must be {'a text' if entry.type is str else 'true or false'}")
        return value
    if entry.type is float:
        return _number(value, where)
    length = 2 if entry.type == Pair else 3
    if not isinstance(value, list) or len(value) != length:
        raise Invalid(f"cannot read the room: {where} must be a list of {length} numbers")
    return tuple(_number(part, where) for part in value)


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise Invalid(f"cannot read the room: {where} must be made of numbers, not {value!r}")
    return float(value)


def _lengths(room: Room) -> Iterator[tuple[str, float]]:
    """Every length that must be greater than 0, and what it is of."""
    for length in (*room.floor.size, room.floor.tile):
        yield "[floor]", length
    for length in (room.door.width, room.door.height, room.door.thickness):
        yield "[door]", length
    for number, wall in enumerate(room.walls, 1):
        for length in (wall.height, wall.thickness, math.dist(wall.start, wall.end)):
            yield f"[[walls]] number {number}", length
    yield from _lengths_of_things(room)


def _lengths_of_things(room: Room) -> Iterator[tuple[str, float]]:
    for item in room.cylinders:
        yield repr(item.name), min(item.radius, item.height)
    for box in room.boxes:
        yield repr(box.name), min(box.size)
    for picture in room.pictures:
        yield repr(picture.name), min(picture.size)
    for person in room.people:
        yield repr(person.name), person.height


def _check(room: Room) -> None:
    for where, length in _lengths(room):
        if length <= 0:
            raise Invalid(f"cannot use the room: a size of {where} must be greater than 0, not {length:g}")
    for kind in [room.floor.picture, *(picture.kind for picture in room.pictures)]:
        if kind not in PICTURES:
            raise Invalid(f"cannot use the room: unknown picture {kind!r}; known are {', '.join(PICTURES)}")
    _check_names(room)
    if not 0 <= room.light.lamp <= 1:
        raise Invalid("cannot use the room: 'lamp' of [light] must be from 0 to 1")
    if not 0.05 < room.overview.field_of_view < 3:
        raise Invalid("cannot use the room: 'field_of_view' of [overview] must be from 0.05 to 3 rad")


def _check_names(room: Room) -> None:
    """Every thing has a name, and every person one of their own."""
    people = [person.name for person in room.people]
    names = [box.name for box in room.boxes] + [item.name for item in room.cylinders]
    names += [picture.name for picture in room.pictures]
    for name in people:
        if people.count(name) + names.count(name) > 1:
            raise Invalid(
                f"cannot use the room: {name!r} is the name of a person and of another; give each person a name of their own"
            )
    if not all([*people, *names]):
        raise Invalid("cannot use the room: a name is empty")
