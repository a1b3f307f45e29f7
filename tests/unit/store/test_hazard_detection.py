"""hazard_detection, against the core agent that authors test with: what it says and does when something is amiss."""

import asyncio
import importlib.util
import json
import math
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rapp_api import DynamicAgent, Invalid, Pose, Refused, Unreachable
from rapp_api.entry import load
from rapp_api.testing import FakeCoreAgent

FOLDER = Path(__file__).parents[3] / "store" / "hazard_detection"
OBSTACLE = Refused("cannot walk: there is an obstacle 0.28 m ahead, seen by the left sonar; turn, or go round it")
AWAY = Unreachable("cannot reach the platform: no answer")
PROFILE = {"name": "Maria", "contacts": [{"name": "Elizabeth", "address": "elizabeth@home.example"}]}
HERE = Pose(0.3, -0.2, 2.0)
FOCAL = 640 / math.tan(math.radians(60.97) / 2)  # pixels of a picture that is 1280 wide

SAFE = {
    "door": {"sure": True, "hazard": False, "words": "the door is closed"},
    "lamp": {"sure": True, "hazard": False, "words": "the lamp is off"},
}
OPEN = {**SAFE, "door": {"sure": True, "hazard": True, "words": "the door is open by about 40 degrees"}}
UNSURE = {**SAFE, "door": {"sure": False, "hazard": None, "words": "I am not sure about the door"}}


@pytest.fixture(autouse=True)
def own_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The RApp leaves its pictures in the temporary folder, which is its run's own only when it is confined."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


def seen(*names: str) -> dict[str, Any]:
    """What find_codes answers where the robot stands at HERE; the fake's camera is upright, half a metre above its feet."""
    parameters = json.loads((FOLDER / "dynamic" / "package.json").read_text())["rapp"]["parameters"]
    codes = []
    for text, code in parameters["codes"].items():
        if not any(name in text for name in names):
            continue
        half, facing = code["side"] / 2, code["facing"]
        right = np.array([-math.sin(facing), math.cos(facing), 0.0])
        corners = []
        for across, up in ((-half, half), (half, half), (half, -half), (-half, -half)):
            x, y, z = np.array(code["centre"]) + across * right + [0.0, 0.0, up] - [HERE.x, HERE.y, 0.5]
            ahead = x * math.cos(HERE.theta) + y * math.sin(HERE.theta)
            left = y * math.cos(HERE.theta) - x * math.sin(HERE.theta)
            corners.append([639.5 - FOCAL * left / ahead, 479.5 - FOCAL * z / ahead])
        codes.append({"text": text, "corners": corners})
    return {"codes": codes}


def run(find_codes: Any = None, check: Any = None, **room: Any) -> FakeCoreAgent:
    services = {"find_codes": find_codes or seen("door", "lamp"), "check": check or SAFE}
    wishes = {"services": {"profile": PROFILE}, **room}
    with FakeCoreAgent(package=FOLDER / "dynamic", agent_services=services, **wishes) as core:
        agent: type[DynamicAgent] = load(FOLDER / "dynamic" / "agent.py")
        agent(core.parameters).run()
    return core


def one_by_one(*answers: Any) -> Callable[[Mapping[str, Any]], Any]:
    left = list(answers)

    def answer(_arguments: Mapping[str, Any]) -> Any:
        found = left.pop(0)
        if isinstance(found, Exception):
            raise found
        return found

    return answer


def walks(core: FakeCoreAgent) -> list[tuple[float, float]]:
    return [(path[-1].x, path[-1].y) for name, path in core.calls if name == "move_along_path"]


def test_a_safe_flat_is_said_to_be_safe_and_nobody_is_written_to() -> None:
    core = run()
    assert core.said() == [
        "I look whether everything is safe",
        "I go to the door",
        "I go to the lamp",
        "everything is safe, the door is closed, and the lamp is off",
    ]
    assert core.mails == []
    assert core.posture == "Sit"
    assert sorted(core.kept) == ["door.jpg", "lamp.jpg"]


def test_it_knows_where_it_is_by_two_codes() -> None:
    core = run()
    (pose,) = [pose for name, pose in core.calls if name == "set_global_pose"]
    assert (pose.x, pose.y, pose.theta) == pytest.approx((HERE.x, HERE.y, HERE.theta), abs=1e-3)
    stands = core.parameters["stands"]
    assert walks(core) == [tuple(stands["door"][0]), tuple(stands["lamp"][0])]


@pytest.mark.parametrize("names", [(), ("door",)])
def test_with_too_few_codes_it_says_that_it_does_not_know_where_it_is(names: tuple[str, ...]) -> None:
    core = run(find_codes=seen(*names))
    assert core.said()[-1].startswith("I do not know where I am")
    assert walks(core) == []
    assert core.posture == "Sit"


def test_a_code_that_was_missed_is_looked_for_again() -> None:
    core = run(find_codes=one_by_one(*[seen("door")] * 7, *[seen("door", "lamp")] * 20))
    (pose,) = [pose for name, pose in core.calls if name == "set_global_pose"]
    assert (pose.x, pose.y) == pytest.approx((HERE.x, HERE.y), abs=1e-3)
    assert "move_to" not in [name for name, _ in core.calls]


def test_before_it_gives_up_it_turns() -> None:
    core = run(find_codes=one_by_one(*[seen("door")] * 9, *[seen("door", "lamp")] * 5))
    (turn,) = [argument for name, argument in core.calls if name == "move_to"]
    assert turn == pytest.approx((0, 0, math.pi / 2))
    assert core.said()[-1].startswith("everything is safe")


def test_codes_that_cannot_be_where_they_are_seen_are_not_believed() -> None:
    codes = seen("door", "lamp")
    codes["codes"][0]["corners"] = [[x + 300, y + 90] for x, y in codes["codes"][0]["corners"]]
    assert run(find_codes=codes).said()[-1].startswith("I do not know where I am")


@pytest.mark.parametrize("answer", ["yes", "no", ""])
def test_of_an_open_door_it_writes_only_if_asked(answer: str) -> None:
    core = run(check=OPEN, hears=[answer])
    said = core.said()
    assert said[-3] == "the door is open by about 40 degrees, and the lamp is off; please see to it"
    assert said[-2].startswith("shall I write to Elizabeth?")
    if answer == "yes":
        assert said[-1] == "I have written to Elizabeth"
        assert said[-3] in core.mails[0]["body"]
        assert core.mails[0]["recipients"] == ["elizabeth@home.example"]
    else:
        assert said[-1] == "I write to nobody"
        assert core.mails == []


@pytest.mark.parametrize(
    ("mail", "words"),
    [
        ("kept", "I write to Elizabeth later"),
        ("unknown", "I do not know whether my message to Elizabeth is sent"),
        (Refused("no such address"), "I could not write to Elizabeth"),
    ],
)
def test_it_says_when_a_mail_is_not_sent(mail: Any, words: str) -> None:
    assert run(check=OPEN, hears=["yes"], mail=mail).said()[-1] == words


@pytest.mark.parametrize(
    ("profile", "words"), [(AWAY, "cannot write to anybody"), ({"name": "Maria", "contacts": []}, "see to it")]
)
def test_without_anybody_to_write_to_it_does_not_ask(profile: Any, words: str) -> None:
    core = run(check=OPEN, services={"profile": profile})
    assert words in core.said()[-1]
    assert "recognize" not in [name for name, _ in core.calls]


def test_what_is_not_sure_is_looked_at_again_from_another_side() -> None:
    core = run(check=one_by_one(UNSURE, SAFE))
    assert core.said()[3:] == [
        "I am not sure, I look again",
        "I go to the door",
        "everything is safe, the door is closed, and the lamp is off",
    ]
    assert walks(core)[2] == tuple(core.parameters["stands"]["door"][1])


def test_what_stays_unsure_is_said_to_be() -> None:
    core = run(check=UNSURE, hears=["no"])
    assert core.said().count("I go to the door") == len(core.parameters["stands"]["door"])
    assert "I am not sure about the door, and the lamp is off; please look yourself" in core.said()


def test_an_obstacle_is_told_and_it_looks_from_where_it_is() -> None:
    core = run(walks=[OBSTACLE])
    assert core.said()[1:3] == ["I go to the door", "something is in my way, I cannot get to the door, I look from here"]
    assert core.said()[-1].startswith("everything is safe")
    assert core.posture == "Sit"


@pytest.mark.parametrize("error", [AWAY, Refused("cannot call the cloud agent: it has ended"), Invalid("not JSON")])
def test_it_says_when_its_cloud_agent_is_away(error: Exception) -> None:
    words = "I cannot reach my cloud agent, so I cannot tell whether everything is safe"
    for core in (run(find_codes=error), run(check=error)):
        assert core.said()[-1] == words
        assert core.posture == "Sit"


def test_a_camera_that_gives_no_picture_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    take, left = FakeCoreAgent.capture_image, [5]

    def capture(core: FakeCoreAgent, camera: str, resolution: int) -> tuple[int, int, bytes]:
        left[0] -= 1
        if left[0] < 0:
            raise Unreachable("cannot take a picture: the top camera gives none; try again")
        return take(core, camera, resolution)

    monkeypatch.setattr(FakeCoreAgent, "capture_image", capture)
    said = run(hears=["no"]).said()
    assert "I cannot take a picture of the door" in said
    assert "I have no picture of the door, and I have no picture of the lamp; please look yourself" in said


# the cloud agent


class Platform:
    """Answers as the three services do; how many run at once is seen in `most`."""

    def __init__(self, **answers: Any) -> None:
        self.answers = {
            "hazard_detection_door_check": {"door_angle": 0, "open": False, "confidence": 0.9},
            "hazard_detection_light_check": {"light_level": 0, "on": False, "confidence": 0.9},
            "qr_detection": {"qr_centers": [], "qr_messages": [], "qr_corners": []},
        } | answers
        self.running = self.most = 0

    async def call(self, name: str, args: Mapping[str, Any], timeout: float = 30.0) -> Any:
        del timeout
        self.running += 1
        self.most = max(self.most, self.running)
        await asyncio.sleep(0)
        self.running -= 1
        answer = self.answers[name]
        return answer(args) if callable(answer) else answer


def check(platform: Platform) -> Any:
    spec = importlib.util.spec_from_file_location("cloud_agent_of_hazard_detection", FOLDER / "cloud" / "agent.py")
    assert spec is not None and spec.loader is not None
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    program.repository = platform
    return asyncio.run(program.check.function(door=Path("door.jpg"), lamp=Path("lamp.jpg")))


def test_the_cloud_agent_composes_the_services_side_by_side() -> None:
    platform = Platform()
    found = check(platform)
    assert [part["words"] for part in found.values()] == ["the door is closed", "the lamp is off"]
    assert platform.most == 4


@pytest.mark.parametrize(("angle", "told"), [(6, 10), (38, 40), (44, 40), (90, 90)])
def test_it_tells_an_open_door_s_angle_in_tens(angle: int, told: int) -> None:
    door = check(Platform(hazard_detection_door_check={"door_angle": angle, "open": True, "confidence": 0.9}))["door"]
    assert (door["hazard"], door["words"]) == (True, f"the door is open by about {told} degrees")


def test_what_the_platform_is_not_sure_of_it_is_not_either() -> None:
    door = {"door_angle": -1, "open": None, "confidence": 0.2}
    lamp = {"light_level": -1, "on": None, "confidence": 0.2}
    found = check(Platform(hazard_detection_door_check=door, hazard_detection_light_check=lamp))
    assert [(part["sure"], part["words"]) for part in found.values()] == [
        (False, "I am not sure about the door"), (False, "I am not sure about the lamp"),
    ]  # fmt: skip


def test_a_picture_of_another_place_is_not_judged() -> None:
    def codes(args: Mapping[str, Any]) -> Any:
        return {"qr_messages": ['{"name": "window"}'] if args["file"].name == "door.jpg" else ['{"name": "lamp"}']}

    found = check(Platform(qr_detection=codes))
    assert (found["door"]["sure"], found["lamp"]["sure"]) == (False, True)
