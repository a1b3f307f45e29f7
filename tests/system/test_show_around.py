"""A tour of the simulated room, on real processes, in the real physics, with the robot's own cameras: without and with an obstacle.

Both run at once; words go as text, so that a tour takes no longer than its walks.
"""

import json
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from fakes.whole_robot import processes_of
from rapp_cli.paths import ROOT

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]
TIMEOUT = 240  # s of one tour
BLUE = (190, 90, 20)  # the path in the drawing
BOTH = pytest.mark.parametrize("name", ["free", "obstacle"])


@dataclass(frozen=True)
class Tour:
    """A finished one."""

    status: int
    output: str
    folder: Path

    @property
    def entries(self) -> list[dict[str, str]]:
        return [json.loads(line) for line in (self.folder / "timeline.jsonl").read_text().splitlines()]

    @property
    def said(self) -> list[str]:
        return [e["detail"] for e in self.entries if e["kind"] == "said"]

    def picture(self, name: str) -> Any:
        return cv2.imread(str(self.folder / "robot" / "keepsakes" / "show_around" / name))


def run(folder: Path, *options: str) -> Tour:
    words = [str(ROOT / "rapp"), "demo", "show-around", "--silent", "--folder", str(folder), *options]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT, check=False)
    return Tour(done.returncode, done.stdout, folder)


@pytest.fixture(scope="module")
def tours(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Tour]]:
    with ThreadPoolExecutor() as pool:
        wishes: dict[str, tuple[str, ...]] = {"free": (), "obstacle": ("--obstacle",)}
        runs = {name: pool.submit(run, tmp_path_factory.mktemp(name), *options) for name, options in wishes.items()}
        yield {name: tour.result() for name, tour in runs.items()}


@BOTH
def test_it_comes_back_with_all_pictures_having_touched_nothing(tours: dict[str, Tour], name: str) -> None:
    tour = tours[name]
    assert tour.status == 0, tour.output
    named = [line.split()[1] for line in tour.output.splitlines() if line.startswith(("picture", "path"))]
    assert [Path(path).name for path in named] == ["lamp.jpg", "table.jpg", "door.jpg", "path.png"]
    assert all(Path(path).is_file() for path in named)
    assert tour.said[-1] == "I am back, I have kept 3 pictures and my path"
    assert processes_of(tour.folder) == []


@BOTH
def test_the_pictures_show_what_they_are_named_after(tours: dict[str, Tour], name: str) -> None:
    tour = tours[name]
    blue, green, red = (tour.picture("table.jpg")[..., channel].astype(int) for channel in range(3))
    assert ((red > 2 * blue) & (red > 2 * green)).sum() > 1000, "the cup on the table"
    blue, green, red = (tour.picture("lamp.jpg")[..., channel].astype(int) for channel in range(3))
    assert ((red > 180) & (green > 150) & (blue < 0.8 * red)).sum() > 3000, "the lampshade"
    assert cv2.QRCodeDetector().detectAndDecode(tour.picture("door.jpg"))[0] == '{"name": "door"}'


@BOTH
def test_the_path_is_drawn_as_it_was_walked(tours: dict[str, Tour], name: str) -> None:
    rows, columns = np.nonzero((tours[name].picture("path.png") == BLUE).all(axis=2))
    assert (columns.max() - columns.min()) / 180 > 0.5  # m
    assert (rows.max() - rows.min()) / 180 > 1.0


@BOTH
def test_it_says_what_it_does_and_rests(tours: dict[str, Tour], name: str) -> None:
    tour = tours[name]
    wanted = [text for place in ("lamp", "table", "door") for text in (f"I go to the {place}", f"this is the {place}")]
    assert [text for text in tour.said if text in wanted] == wanted
    assert "dynamic->core rapp_rest" in [e["detail"] for e in tour.entries if e["kind"] == "message"]
    assert [e["state"] for e in tour.entries if e["kind"] == "entered" and "/" not in e["state"]][-1] == "s3"


def test_only_an_obstacle_stops_it_and_it_goes_round(tours: dict[str, Tour]) -> None:
    text = "something is in my way, I go round it"
    assert text not in tours["free"].said
    assert tours["obstacle"].said.index(text) == tours["obstacle"].said.index("I go back") + 1
    refusals = [e["detail"] for e in tours["obstacle"].entries if "rapp_move_along_path: refused" in e["detail"]]
    assert refusals == ["core->dynamic reply rapp_move_along_path: refused"]
