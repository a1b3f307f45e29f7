"""The demo's judgement of a tour: all pictures, back where it began, nothing touched."""

import asyncio
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from rapp_cli.demo.config import SHOW_AROUND, DemoConfig
from rapp_cli.demo.show_around import NEAR, ShowAround
from rapp_cli.timeline import Entry, Timeline

FILES = ("lamp.jpg", "table.jpg", "door.jpg", "path.png")
PHOTO = np.arange(30 * 40 * 3, dtype=np.uint8).reshape(30, 40, 3)
BEGUN = [0.3, -0.25, -1.15]


class Room:
    """A person who only watches; the tour takes no time."""

    def __init__(self, timeline: Timeline, ended: Sequence[float], touched: Sequence[str]) -> None:
        self.asked: list[tuple[str, tuple[Any, ...]]] = []
        self._timeline, self._ended = timeline, ended
        self._pose: Sequence[float] = BEGUN
        self._touched = [["floor lamp, before the tour"], list(touched)]

    async def ask_room(self, method: str, *values: Any) -> Any:
        self.asked.append((method, values))
        answers = {"getRobotPose": lambda: self._pose, "takeTouched": lambda: self._touched.pop(0), "placeObject": lambda: None}
        return answers[method]()

    def forget(self) -> None:
        pass

    async def say(self, _text: str) -> None:
        for state in ("s9", "s3"):
            await self._timeline.add(Entry("core", "core", state, "entered", ""))
        self._pose = self._ended


def config(folder: Path, obstacle: bool = False, robot: str | None = None) -> DemoConfig:
    return DemoConfig(
        story=SHOW_AROUND, folder=folder, command="show me around", recipient="", message="", voice="", robot=robot, cloud=None,
        mail=None, address="", timeout=1.0, obstacle=obstacle, silent=True,
    )  # fmt: skip


def write(folder: Path, *names: str) -> None:
    kept = folder / "robot" / "keepsakes" / "show_around"
    kept.mkdir(parents=True)
    for name in names:
        cv2.imwrite(str(kept / name), PHOTO)


def judged(
    folder: Path, ended: Sequence[float] = BEGUN, touched: Sequence[str] = (), obstacle: bool = False, old: str = ""
) -> tuple[int, Room]:
    """The pictures that are there are those of this tour, but for the one that is `old`."""

    async def tour() -> tuple[int, Room]:
        timeline = Timeline()
        await timeline.add(Entry("core", "core", "s3", "entered", ""))
        room = Room(timeline, ended, touched)
        story = ShowAround(config(folder, obstacle), None)  # type: ignore[arg-type]
        await story.live(room, timeline)  # type: ignore[arg-type]
        for path in (folder / "robot" / "keepsakes" / "show_around").iterdir():
            taken = 1.0 if path.name == old else time.time() + 1  # a file system's clock goes in steps
            os.utime(path, (taken, taken))
        return await story.judge(timeline), room

    return asyncio.run(tour())


def test_a_good_tour_is_one_that_ends_well(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, *FILES)
    assert judged(tmp_path)[0] == 0
    printed = capsys.readouterr().out
    assert all(str(tmp_path / "robot" / "keepsakes" / "show_around" / name) in printed for name in FILES)
    assert "touched nothing" in printed


@pytest.mark.parametrize("missing", FILES)
def test_a_missing_picture_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str], missing: str) -> None:
    write(tmp_path, *[name for name in FILES if name != missing])
    assert judged(tmp_path)[0] == 1
    assert f"{missing} is missing" in capsys.readouterr().err


def test_a_picture_that_another_run_left_is_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, *FILES)
    assert judged(tmp_path, old="lamp.jpg")[0] == 1
    assert "rapp demo: lamp.jpg is missing" in capsys.readouterr().err


def test_a_picture_of_nothing_is_none(tmp_path: Path) -> None:
    write(tmp_path, *FILES)
    cv2.imwrite(str(tmp_path / "robot" / "keepsakes" / "show_around" / "lamp.jpg"), np.zeros((30, 40, 3), np.uint8))
    assert judged(tmp_path)[0] == 1


def test_a_robot_that_is_not_back_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, *FILES)
    assert judged(tmp_path, ended=[BEGUN[0] + NEAR + 0.01, BEGUN[1], 0.0])[0] == 1
    assert "not back" in capsys.readouterr().err


def test_what_was_touched_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, *FILES)
    assert judged(tmp_path, touched=["carton"])[0] == 1
    assert "touched carton" in capsys.readouterr().out


def test_an_obstacle_stands_on_the_way_back(tmp_path: Path) -> None:
    write(tmp_path, *FILES)
    _, room = judged(tmp_path, obstacle=True)
    (place,) = [values for method, values in room.asked if method == "placeObject"]
    assert place[0] == "carton"
    assert min(0.30, 0.35) < place[1] < max(0.30, 0.35)
    assert -0.25 < place[2] < 0.80
