"""show_around, against the core agent that authors test with: its pictures, its path, and what it does when stopped."""

import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from rapp_api import DynamicAgent, Pose, Refused, Unreachable
from rapp_api.entry import load
from rapp_api.testing import FakeCoreAgent

FOLDER = Path(__file__).parents[3] / "store" / "show_around"
HOME = Pose(0.30, -0.25, -1.15)
OBSTACLE = Refused("cannot walk: there is an obstacle 0.28 m ahead, seen by the left sonar; turn, or go round it")
PLACES = ["lamp", "table", "door"]


def tour(**room: Any) -> FakeCoreAgent:
    with FakeCoreAgent(package=FOLDER, **room) as core:
        agent: type[DynamicAgent] = load(FOLDER / "agent.py")
        agent(core.parameters).run()
    return core


def walks(core: FakeCoreAgent) -> list[list[Pose]]:
    return [path for name, path in core.calls if name == "move_along_path"]


def test_it_walks_to_three_places_takes_a_picture_of_each_comes_back_and_rests() -> None:
    views = [np.full((480, 640, 3), shade, np.uint8) for shade in (50, 100, 150)]
    core = tour(pictures=views)
    goals = [path[-1] for path in walks(core)]
    assert [(goal.x, goal.y) for goal in goals[:3]] == [tuple(place["stand"]) for place in core.parameters["places"]]
    assert goals[3] == HOME
    assert core.said() == [
        "I show you around",
        *[text for name in PLACES for text in (f"I go to the {name}", f"this is the {name}")],
        "I go back",
        "I am back, I have kept 3 pictures and my path",
    ]
    assert core.posture == "Sit"
    assert list(core.kept) == ["lamp.jpg", "table.jpg", "door.jpg", "path.png"]
    for name, view in zip(PLACES, views, strict=True):
        seen = cv2.imdecode(np.frombuffer(core.kept[f"{name}.jpg"], np.uint8), cv2.IMREAD_COLOR)
        assert np.abs(seen.astype(int) - view).max() <= 2


def test_it_looks_at_each_place_from_where_it_stands() -> None:
    core = tour()
    looks = [point for name, point in core.calls if name == "look_at_point"]
    for place, (x, y, z) in zip(core.parameters["places"], looks, strict=True):
        assert math.hypot(x, y) == pytest.approx(math.dist(place["stand"], place["look"][:2]))
        assert z == place["look"][2]


def test_the_path_is_drawn_over_the_room() -> None:
    sheet = cv2.imdecode(np.frombuffer(tour().kept["path.png"], np.uint8), cv2.IMREAD_COLOR)
    height, width = sheet.shape[:2]
    assert (height, width) == (800, 800)  # 4 m x 4 m, at 180 pixels a metre, and a border
    blue = (sheet == (190, 90, 20)).all(axis=2)
    rows, columns = np.nonzero(blue)
    assert columns.min() == pytest.approx(40 + 180 * (1.5 - 0.22), abs=6)  # the table's place
    assert columns.max() == pytest.approx(40 + 180 * (1.5 + 0.35), abs=6)  # the door's
    assert rows.min() == pytest.approx(40 + 180 * (1.8 - 0.80), abs=6)
    assert rows.max() == pytest.approx(40 + 180 * (1.8 + 0.30), abs=6)  # the lamp's


def test_a_robot_that_knows_where_it_is_is_not_told() -> None:
    with FakeCoreAgent(package=FOLDER) as core:
        core.pose = Pose(0.5, -0.5, 1.0)
        load(FOLDER / "agent.py")(core.parameters).run()
    assert "set_global_pose" not in [name for name, _ in core.calls]
    assert walks(core)[-1][-1] == Pose(0.5, -0.5, 1.0)


def test_an_obstacle_is_gone_round_on_the_roomier_side() -> None:
    core = tour(walks=[None, OBSTACLE])
    assert core.said()[3:6] == ["I go to the table", "something is in my way, I go round it", "this is the table"]
    stopped, round_ = walks(core)[1:3]
    assert len(round_) == 3
    assert round_[-1].x == stopped[-1].x
    # Away from the lamp, which stands on the other side.
    assert all(pose.x > 0.15 for pose in round_[:2])
    assert core.said()[-1].startswith("I am back, I have kept 3 pictures")


def test_an_obstacle_on_both_sides_is_given_up_and_the_picture_is_taken_from_there() -> None:
    core = tour(walks=[None, OBSTACLE, OBSTACLE, OBSTACLE])
    said = core.said()
    assert said[3:6] == ["I go to the table", *["something is in my way, I go round it"] * 2]
    assert said[6:8] == ["something is in my way, I cannot get to the table", "this is the table"]
    lamp, table = (core.parameters["places"][number]["stand"] for number in (0, 1))
    line = math.atan2(table[1] - lamp[1], table[0] - lamp[0])
    sides = [math.sin(math.atan2(way[0].y - lamp[1], way[0].x - lamp[0]) - line) for way in walks(core)[2:4]]
    assert sides == pytest.approx([-1, 1])
    assert "table.jpg" in core.kept


def test_an_obstacle_where_it_would_stand_is_not_gone_round() -> None:
    core = tour(walks=[OBSTACLE])
    assert core.said()[1:4] == ["I go to the lamp", "something is in my way, I cannot get to the lamp", "this is the lamp"]


def test_it_turns_to_what_its_neck_does_not_reach() -> None:
    core = tour(walks=[None, None, OBSTACLE, OBSTACLE, OBSTACLE, None])
    assert all(abs(math.atan2(y, x)) < 1.6 for name, (x, y, _) in [call for call in core.calls if call[0] == "look_at_point"])


def test_a_robot_that_cannot_get_back_says_so_and_rests() -> None:
    core = tour(walks=[None, None, None, OBSTACLE, OBSTACLE, OBSTACLE])
    assert core.said()[-2] == "something is in my way, I cannot get back"
    assert core.said()[-1].startswith("I am not back, please help me, I have kept 3 pictures")
    assert core.posture == "Sit"
    assert "path.png" in core.kept


def blind(monkeypatch: pytest.MonkeyPatch, times: int) -> None:
    """The camera fails so often."""
    left, take = [times], FakeCoreAgent.capture_image

    def capture(core: FakeCoreAgent, camera: str, resolution: int) -> tuple[int, int, bytes]:
        left[0] -= 1
        if left[0] >= 0:
            raise Unreachable("cannot take a picture: the top camera gives none; try again")
        return take(core, camera, resolution)

    monkeypatch.setattr(FakeCoreAgent, "capture_image", capture)


def test_a_picture_that_fails_is_taken_again(monkeypatch: pytest.MonkeyPatch) -> None:
    blind(monkeypatch, 2)
    assert "lamp.jpg" in tour().kept


def test_without_a_picture_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    blind(monkeypatch, 100)
    core = tour()
    assert sum(text.startswith("I cannot take a picture") for text in core.said()) == 3
    assert list(core.kept) == ["path.png"]
    assert core.said()[-1] == "I am back, I have kept 0 pictures and my path"
