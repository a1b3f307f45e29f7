"""The world as its user sees it: a client of the physics process and, for pictures, of the renderer process."""

import contextlib
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rapp_nao_sim.world.cameras import Settings
from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.room import Room
from rapp_nao_sim.world.views import Shot, Views
from rapp_nao_sim.world.worker import Worker

MOVE_TIMEOUT = 30.0  # s, more than any movement at full speed takes, with its planning


@dataclass(frozen=True)
class WorldConfig:
    """Settings of the world."""

    room: Path | None = None  # room file; None: our own
    posture: str | None = None  # at the start; None: the room file's
    pace: float = 1.0  # simulated seconds per second; the physics can do about 10
    start_timeout: float = 30.0  # s, until the robot stands in its room
    width: int = 960  # pixels of photographs
    height: int = 720


class WorldClient:
    """Starts, commands and ends the world; all calls are bounded in time and may come from any thread.

    m, rad, s, in the room's frame. Every call raises Refused (ask differently) or Unreachable (the process is gone or silent).
    """

    def __init__(self, config: WorldConfig | None = None) -> None:
        self._config = config or WorldConfig()
        self._physics = Worker("rapp_nao_sim.world.physics")
        self._views = Views(lambda: self._physics.call("snapshot"), self._physics.alive)

    def start(self) -> None:
        """Start the physics process and wait until the robot is in its room; raises Invalid for a wrong room file."""
        config = self._config
        self._physics.start()
        try:
            self._views.show(lambda: self._room("set_up", config.room, config.posture, config.pace))
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the processes and wait for them."""
        self._physics.close()  # first: a picture that fails by the renderer's end is not tried again then
        self._views.close()

    def __enter__(self) -> "WorldClient":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """Number of the physics process."""
        return self._physics.pid

    def alive(self) -> bool:
        """Whether the physics process runs."""
        return self._physics.alive()

    def robot_pose(self) -> tuple[float, float, float]:
        """x and y of the middle of the soles, and the heading."""
        return self._tuple("robot_pose")

    def velocity(self) -> tuple[float, float, float]:
        """vx, vy and turning of the torso."""
        return self._tuple("velocity")

    def joint_angles(self, names: Sequence[str]) -> list[float]:
        """What the joints' sensors read."""
        return self._list("joint_angles", names)

    def commanded_angles(self, names: Sequence[str]) -> list[float]:
        """Where the motors are told to be now."""
        return self._list("commanded_angles", names)

    def stiffnesses(self, names: Sequence[str]) -> list[float]:
        """Shares of the motors' torque, 0 to 1."""
        return self._list("stiffnesses", names)

    def set_stiffness(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Set shares of the motors' torque, 0 to 1."""
        self._physics.call("set_stiffness", list(names), list(values))

    def set_joints(self, names: Sequence[str], angles: Sequence[float], fraction: float) -> None:
        """Send joints to angles at a fraction of their greatest speed; does not wait. Angles beyond a range become its end."""
        self._physics.call("set_joints", list(names), list(angles), fraction)

    def move_joints(self, names: Sequence[str], angles: Sequence[Sequence[float]], times: Sequence[Sequence[float]]) -> bool:
        """Send each joint through its angles at its times, and wait; false when something stopped it."""
        longest = max((max(when, default=0.0) for when in times), default=0.0)
        args = list(names), [list(way) for way in angles], [list(when) for when in times]
        return bool(self._physics.call("move_joints", *args, timeout=MOVE_TIMEOUT + longest))

    def set_posture(self, name: str, speed: float) -> bool:
        """Take a posture at a speed from 0 to 1, and wait; gives whether it is reached."""
        if not 0 < speed <= 1:
            raise Refused(f"cannot take a posture at speed {speed:g}; give more than 0 and at most 1")
        return bool(self._physics.call("set_posture", name, speed, timeout=MOVE_TIMEOUT / speed))

    def posture(self) -> tuple[str, str]:
        """Name ("Unknown" in between) and family of the posture the body is in."""
        name, family = self._physics.call("posture")
        return str(name), str(family)

    def wake_up(self) -> bool:
        """Stiffen the joints and stand up, and wait; gives whether it stands."""
        return bool(self._physics.call("wake_up", timeout=MOVE_TIMEOUT))

    def rest(self) -> bool:
        """Crouch, remove the stiffness, and wait; false when something stopped it."""
        return bool(self._physics.call("rest", timeout=MOVE_TIMEOUT))

    def stop(self) -> None:
        """End all movement; who waits for it hears false."""
        self._physics.call("stop")

    def is_moving(self) -> bool:
        """Whether a command is under way."""
        return bool(self._physics.call("is_moving"))

    def awake(self) -> bool:
        """Whether the legs have stiffness."""
        return bool(self._physics.call("awake"))

    def fallen(self) -> bool:
        """Whether the robot lies without having been told to."""
        return bool(self._physics.call("fallen"))

    def push(self, force: Sequence[float], seconds: float = 0.1) -> None:
        """Push the torso with a force in N along the room's axes."""
        self._physics.call("push", list(force), seconds)

    def set_door(self, angle: float) -> None:
        """Turn the door to an opening angle."""
        self._physics.call("set_door", angle)

    def set_lamp(self, level: float) -> None:
        """Set the lamp from 0 (dark) to 1."""
        self._physics.call("set_lamp", level)

    def furnishing(self) -> tuple[float, float]:
        """Angle of the door and level of the lamp."""
        door, lamp = self._physics.call("furnishing")
        return float(door), float(lamp)

    def place_object(self, name: str, place: Sequence[float]) -> None:
        """Put a thing at x, y, z, theta: what `centre` and `yaw` or `facing` of its first part are in the room file."""
        self._physics.call("place_object", name, list(place))

    def place_person(self, name: str, place: Sequence[float]) -> None:
        """Put a person on the floor at x, y, facing theta."""
        self._physics.call("place_person", name, list(place))

    def remove_object(self, name: str) -> None:
        """Take a thing or a person out of the room; placing brings it back."""
        self._physics.call("remove_object", name)

    def objects(self) -> list[dict[str, Any]]:
        """Every thing: name, kind, placed, x, y, z, theta; voice of a person."""
        found: list[dict[str, Any]] = self._physics.call("objects")
        return found

    def load_room(self, file: Path) -> None:
        """Have another room, with the robot at its start; raises Invalid for a wrong room file."""
        self._views.show(lambda: self._room("load_room", file))

    def photograph(self, path: Path | str) -> None:
        """Write a picture of the room as a PNG file; the physics goes on meanwhile."""
        _write(Path(path), self._views.overview(self._config.width, self._config.height))

    def shot(self, camera: int, resolution: int, settings: Settings, colour: int) -> Shot:
        """What a camera of the robot sees; numbers as in `cameras`."""
        return self._views.shot(camera, resolution, settings, colour)

    def _room(self, verb: str, *args: Any) -> Room:
        room: Room = self._physics.call(verb, *args, timeout=self._config.start_timeout)
        return room

    def _tuple(self, verb: str) -> tuple[float, float, float]:
        x, y, turn = self._physics.call(verb)
        return float(x), float(y), float(turn)

    def _list(self, verb: str, names: Sequence[str]) -> list[float]:
        values: Any = self._physics.call(verb, list(names))
        return [float(value) for value in values]


def _write(path: Path, data: bytes) -> None:
    """Write aside, then rename: nobody sees half a picture."""
    try:
        descriptor, aside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise Refused(f"cannot write {path}: {error.strerror}; name another file") from error
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        Path(aside).chmod(0o644)
        Path(aside).replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            Path(aside).unlink()
        raise Refused(f"cannot write {path}: {error.strerror}; name another file") from error
