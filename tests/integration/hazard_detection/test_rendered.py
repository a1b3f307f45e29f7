"""hazard_detection on rendered pictures: RApp, cloud agent and services, in this process; only walking takes no time.

Where the robot stands when it takes a picture is where it would truly be: it has found out where it is by the codes that it sees
from its start, and that is not exact.
"""

import asyncio
import math
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from fakes.rendered_room import VGA, RenderedRoom
from fakes.seeing_robot import STORE, SeeingRobot, cloud_agent
from rapp_api import Pose
from rapp_api.entry import load
from rapp_cli.demo.hazard import Truth, contradictions
from rapp_cloud.vision.door import look_at_door
from rapp_cloud.vision.light import ON, look_at_lamp
from rapp_nao_sim.world import room as rooms

pytestmark = pytest.mark.timeout(300)
PROFILE = {"name": "Maria", "contacts": [{"name": "Elizabeth", "address": "elizabeth@home.example"}]}
PLAN = rooms.load()
STARTS = {"home": Pose(PLAN.robot.x, PLAN.robot.y, PLAN.robot.theta)} | {s.name: Pose(s.x, s.y, s.theta) for s in PLAN.starts}
ANGLES = range(0, 91, 10)


@pytest.fixture(autouse=True)
def own_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The RApp leaves its pictures in the temporary folder, which is its run's own only when it is confined."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


@pytest.fixture(scope="module")
def room() -> RenderedRoom:
    return RenderedRoom()


def run(room: RenderedRoom, start: str, angle: float, lamp: float) -> SeeingRobot:
    """The whole RApp; the room's door opens inwards."""
    with SeeingRobot(room, STARTS[start], -angle, lamp, hears=["yes"], services={"profile": PROFILE}) as robot:
        load(STORE / "dynamic" / "agent.py")(robot.parameters).run()
    return robot


@lru_cache(maxsize=len(STARTS))
def first(room: RenderedRoom, start: str) -> SeeingRobot:
    """A run from a start; its last two pictures are of door and lamp."""
    return run(room, start, 0.0, 0.0)


def judged(robot: SeeingRobot, folder: Path, angle: float, lamp: float) -> dict[str, Any]:
    """What the cloud agent makes of pictures taken from where a robot has taken its own, of another door and lamp."""
    robot.door, robot.lamp = -angle, lamp
    files = {name: folder / f"{name}.jpg" for name in ("door", "lamp")}
    for path, (true, head) in zip(files.values(), robot.views[-2:], strict=True):
        path.write_bytes(cv2.imencode(".jpg", robot.view(true, head, VGA), [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes())
    found: dict[str, Any] = asyncio.run(cloud_agent().check.function(**files))
    return found


@pytest.mark.parametrize("start", STARTS)
def test_it_finds_out_where_it_is(room: RenderedRoom, start: str) -> None:
    robot = first(room, start)
    assert math.hypot(robot.true.x - robot.pose.x, robot.true.y - robot.pose.y) < 0.1
    assert abs(math.remainder(robot.true.theta - robot.pose.theta, math.tau)) < math.radians(3)
    assert robot.said()[-1] == "everything is safe, the door is closed, and the lamp is off"


@pytest.mark.parametrize("start", STARTS)
def test_the_answer_is_right_for_every_door_and_lamp(room: RenderedRoom, start: str, tmp_path: Path) -> None:
    unsure = []
    for angle in ANGLES:
        for lamp in (0.0, 1.0):
            found = judged(first(room, start), tmp_path, angle, lamp)
            if all(part["sure"] for part in found.values()):
                words = ", and ".join(part["words"] for part in found.values())
                assert contradictions([words], Truth(angle, lamp)) == [], (angle, lamp)
            else:
                unsure.append((angle, lamp))
    assert len(unsure) <= 2
    for angle, lamp in unsure:  # it looks again from another side
        said = run(room, start, angle, lamp).said()
        assert "I am not sure, I look again" in said
        assert contradictions(said, Truth(angle, lamp)) == [], (angle, lamp)


def test_it_writes_what_it_has_said(room: RenderedRoom) -> None:
    robot = run(room, "window", 60.0, 1.0)
    answer = "the door is open by about 60 degrees, and the lamp is on; please see to it"
    assert robot.said()[-3:] == [answer, "shall I write to Elizabeth? please say yes or no", "I have written to Elizabeth"]
    (mail,) = robot.mails
    assert mail["recipients"] == ["elizabeth@home.example"]
    assert answer in mail["body"]


def test_pictures_from_elsewhere_that_were_used_for_no_choice(room: RenderedRoom) -> None:
    """Other distances, directions, lamps, noise, JPEG, and doors to the other side: seldom silent, never wrong."""
    random, sure, count = np.random.default_rng(2024), 0, 30
    for _ in range(count):
        angle, side = float(random.integers(0, 10) * 10), random.choice([-1, -1, -1, 1])
        stand = (random.uniform(-0.5, 0.5), random.uniform(-0.6, 0.1), 1.4)
        look = (0.55 + random.uniform(-0.2, 0.2), 1.8, 0.72 + random.uniform(-0.12, 0.12))
        picture = room.picture(stand, look, math.radians(side * angle), random.choice([0.0, 0.3, 0.6, 1.0]))
        door = look_at_door(_rough(picture, random))
        sure += door.sure
        assert not door.sure or door.angle is None or abs(math.degrees(door.angle) - angle) < 5, (angle, side, stand)
    assert sure >= 0.6 * count


def test_lamps_from_elsewhere_that_were_used_for_no_choice(room: RenderedRoom) -> None:
    random, sure, count = np.random.default_rng(2025), 0, 30
    for _ in range(count):
        x, y = -1.22, 0.3
        while math.hypot(x + 1.22, y - 0.3) < 0.8:
            x, y = random.uniform(-0.6, 1.2), random.uniform(-1.0, 0.9)
        lamp = random.choice([0.0, 0.1, 0.2, 0.9, 1.0])
        look = tuple(part + random.uniform(-0.03, 0.03) for part in (-1.22, 0.3, 1.02))
        light = look_at_lamp(_rough(room.picture((x, y, math.atan2(0.3 - y, -1.22 - x)), look, lamp=lamp), random))
        sure += light.sure
        assert not light.sure or light.level is None or (light.level >= ON) == (lamp > 0.5), (lamp, x, y)
    assert sure >= 0.85 * count


def _rough(picture: Any, random: Any) -> Any:
    """With a camera's noise, and as JPEG."""
    noisy = np.clip(picture + random.normal(0, random.choice([0, 2, 4, 8]), picture.shape), 0, 255).astype(np.uint8)
    return cv2.imdecode(cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, 85])[1], cv2.IMREAD_COLOR)
