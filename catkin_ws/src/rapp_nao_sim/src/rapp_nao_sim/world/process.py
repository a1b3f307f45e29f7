"""The world as its user sees it: a client of the physics process and, for pictures, of the renderer process."""

import contextlib
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rapp_nao_sim.world.body_client import BodyClient
from rapp_nao_sim.world.cameras import Settings
from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.onlooker import Onlooker
from rapp_nao_sim.world.room import Room
from rapp_nao_sim.world.views import Shot, Views
from rapp_nao_sim.world.worker import Worker


@dataclass(frozen=True)
class WorldConfig:
    """Settings of the world."""

    room: Path | None = None  # room file; None: our own
    posture: str | None = None  # at the start; None: the room file's
    pace: float = 1.0  # simulated seconds per second; 0: as many as the computer can do
    start_timeout: float = 30.0  # s, until the robot stands in its room
    width: int = 960  # pixels of photographs
    height: int = 720
    window: bool = False  # whether a window shows the room, where there is a screen


class WorldClient(BodyClient):
    """Starts, commands and ends the world; all calls are bounded in time and may come from any thread.

    m, rad, s, in the room's frame. Every call raises Refused (ask differently) or Unreachable (the process is gone or silent).
    """

    def __init__(self, config: WorldConfig | None = None) -> None:
        self._config = config or WorldConfig()
        super().__init__(Worker("rapp_nao_sim.world.physics"))
        self._views = Views(lambda: self._physics.call("snapshot"), self._physics.alive)
        self._onlooker = Onlooker(self._views.scenery)

    def start(self) -> None:
        """Start the physics process and wait until the robot is in its room; raises Invalid for a wrong room file."""
        config = self._config
        self._physics.start()
        try:
            self._views.show(lambda: self._room("set_up", config.room, config.posture, config.pace))
            if config.window:
                self._onlooker.open()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the processes and wait for them."""
        self._onlooker.close()
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

    def start_at(self, name: str) -> None:
        """Put the robot at one of the room's `starts`, in its first posture."""
        self._physics.call("start_at", name)

    def photograph(self, path: Path | str) -> None:
        """Write a picture of the room as a PNG file; the physics goes on meanwhile."""
        _write(Path(path), self._views.overview(self._config.width, self._config.height))

    def shot(self, camera: int, resolution: int, settings: Settings, colour: int) -> Shot:
        """What a camera of the robot sees; numbers as in `cameras`."""
        return self._views.shot(camera, resolution, settings, colour)

    def _room(self, verb: str, *args: Any) -> Room:
        room: Room = self._physics.call(verb, *args, timeout=self._config.start_timeout)
        return room


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
