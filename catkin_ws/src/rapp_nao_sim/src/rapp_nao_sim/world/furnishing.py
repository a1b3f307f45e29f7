"""The physics' room as it changes at run time: door, lamp, and where things and people are."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.room import Room
from rapp_nao_sim.world.scene import Scene
from rapp_nao_sim.world.things import Place, Thing, things

_FARTHEST = 100.0  # m


class Furnishing:
    """Nothing is put where the robot is: that is refused, and all stays as it was."""

    def __init__(self, bullet: Any, room: Room, touched: Callable[[int], bool], changed: Callable[[], None]) -> None:
        self._bullet = bullet
        self._touched = touched  # whether a body touches the robot
        self._changed = changed
        self._scene: Scene | None = None
        self.furnish(room)

    def furnish(self, room: Room) -> None:
        """Have this room instead."""
        if self._scene is not None:
            self._scene.close()
        self._scene = Scene(self._bullet, room, pictures=False)
        self._known = things(room)
        self._places = {name: thing.home if thing.placed else None for name, thing in self._known.items()}
        self._door, self._lamp = room.door.angle, room.light.lamp
        self._changed()

    def state(self) -> dict[str, Any]:
        """What the renderer must know."""
        return {"door": self._door, "lamp": self._lamp, "places": dict(self._places)}

    def names(self) -> dict[int, str]:
        """What the room's solid bodies are called."""
        assert self._scene is not None
        return self._scene.names()

    def commands(self) -> dict[str, Callable[..., Any]]:
        """What the physics process offers."""
        return {
            "set_door": self.set_door,
            "set_lamp": self.set_lamp,
            "furnishing": lambda: (self._door, self._lamp),
            "place_object": self.place_object,
            "place_person": self.place_person,
            "remove_object": self.remove_object,
            "objects": self.objects,
        }

    def set_door(self, angle: float) -> None:
        """Turn the door to an opening angle, rad."""
        if not abs(angle) <= math.pi:
            raise Refused("cannot turn the door: its opening angle is at most pi to each side")
        assert self._scene is not None
        if any(map(self._touched, self._scene.set_door(float(angle)))):
            self._scene.set_door(self._door)
            raise Refused("cannot turn the door: the robot stands in its way; move it first")
        self._door = float(angle)
        self._changed()

    def set_lamp(self, level: float) -> None:
        """Set the lamp from 0 to 1."""
        if not 0 <= level <= 1:
            raise Refused("cannot set the lamp: its level is from 0 to 1")
        self._lamp = float(level)

    def place_object(self, name: str, place: Sequence[float]) -> None:
        """Put a thing at x, y, z, theta: what `centre` and `yaw` or `facing` of its first part are in the room file."""
        x, y, z, theta = (float(part) for part in place)
        if not all(abs(part) <= _FARTHEST for part in (x, y, z, theta)):
            raise Refused(f"cannot place {name!r}: give metres and radians of at most {_FARTHEST:g}")
        self._move(self._thing(name).name, (x, y, z, theta))

    def place_person(self, name: str, place: Sequence[float]) -> None:
        """Put a person on the floor at x, y, facing theta."""
        people = [known for known, thing in self._known.items() if thing.kind == "person"]
        if name not in people:
            raise Refused(f"cannot find person {name!r}: known are {', '.join(people) or 'none'}")
        x, y, theta = place
        self.place_object(name, (x, y, 0.0, theta))

    def remove_object(self, name: str) -> None:
        """Take a thing or a person out of the room; placing brings it back."""
        self._move(self._thing(name).name, None)

    def objects(self) -> list[dict[str, Any]]:
        """Every thing: name, kind, whether it is in the room, x, y, z, theta (where it was last or is first), voice of a person."""
        return [self._told(thing, self._places[name]) for name, thing in self._known.items()]

    def _told(self, thing: Thing, place: Place | None) -> dict[str, Any]:
        x, y, z, theta = place or thing.home
        told = {"name": thing.name, "kind": thing.kind, "placed": place is not None, "x": x, "y": y, "z": z, "theta": theta}
        return told | ({"voice": thing.voice} if thing.kind == "person" else {})

    def _thing(self, name: str) -> Thing:
        if name not in self._known:
            raise Refused(f"cannot find object {name!r}: known are {', '.join(self._known) or 'none'}")
        return self._known[name]

    def _move(self, name: str, place: Place | None) -> None:
        assert self._scene is not None
        before = self._places[name]
        if any(map(self._touched, self._scene.move(name, place))):
            self._scene.move(name, before)
            raise Refused(f"cannot place {name!r} there: it would touch the robot; choose another place")
        self._places[name] = place
        self._changed()
