"""The story of show_around: the robot walks to three places of its room, takes pictures, and comes back."""

import json
import math
import sys
import time
from pathlib import Path
from typing import Any

import cv2

from rapp_cli.demo.config import DemoConfig
from rapp_cli.demo.story import ask
from rapp_cli.demo.system import System
from rapp_cli.paths import STORE
from rapp_cli.person import Person
from rapp_cli.timeline import Timeline

RAPP = "show_around"
NEAR = 0.5  # m from where it began within which the robot is back
ALONG = 0.55  # of the way back, where the carton stands
LEAST = 5.0  # levels by which a picture of a room varies
CARTON = ("carton", 0.175)  # of the simulated room: its name, and the height of its middle, m


class ShowAround:
    """See `story.Story`."""

    def __init__(self, config: DemoConfig, system: System) -> None:
        self._config = config
        self._kept = config.folder / "robot" / "keepsakes" / RAPP
        self._places: list[dict[str, Any]] = json.loads((STORE / RAPP / "package.json").read_text())["rapp"]["parameters"]["places"]
        self._began = time.time()  # what is older was left in the folder by another run
        self._away = 0.0
        self._touched: list[str] = []

    async def live(self, person: Person, timeline: Timeline) -> None:
        """Ask for it, see where the robot goes, and what it touches."""
        if self._config.obstacle:
            await self._put_in_the_way(person)
        await person.ask_room("takeTouched")
        begun = await person.ask_room("getRobotPose")
        started = await ask(person, self._config.command, timeline)
        await timeline.wait_for("core", "entered", "s3", started)
        ended = await person.ask_room("getRobotPose")
        self._away = math.dist(begun[:2], ended[:2])
        self._touched = await person.ask_room("takeTouched")

    async def _put_in_the_way(self, person: Person) -> None:
        """A carton, on the way from the last place back."""
        x1, y1 = self._places[-1]["stand"]
        x2, y2, _ = await person.ask_room("getRobotPose")
        name, height = CARTON
        await person.ask_room("placeObject", name, x1 + ALONG * (x2 - x1), y1 + ALONG * (y2 - y1), height, 0.0)

    async def judge(self, timeline: Timeline) -> int:
        """0 only when all pictures and the path are there; in the simulator also only when it is back, and has touched nothing."""
        del timeline
        wrong = []
        print()
        for name in [f"{place['name']}.jpg" for place in self._places] + ["path.png"]:
            path = self._kept / name
            there = _shows_something(path, self._began)
            print(f"{'picture' if path.suffix == '.jpg' else 'path':<10} {path if there else f'{name} is missing'}")
            wrong += [] if there else [f"{name} is missing"]
        if self._config.robot is None:
            print(f"{'robot':<10} {self._away:.2f} m from where it began; touched {', '.join(self._touched) or 'nothing'}")
            wrong += ["the robot is not back"] if self._away > NEAR else []
            wrong += ["the robot has touched something"] if self._touched else []
        if wrong:
            print(f"rapp demo: {'; '.join(wrong)}; the logs are in {self._config.folder / 'logs'}", file=sys.stderr)
        return 1 if wrong else 0


def _shows_something(path: Path, since: float) -> bool:
    if not path.exists() or path.stat().st_mtime < since:
        return False
    picture = cv2.imread(str(path))
    return picture is not None and float(picture.std()) > LEAST
