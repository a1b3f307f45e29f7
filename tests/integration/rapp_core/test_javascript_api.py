"""Every function that a RApp in JavaScript has for the robot, used on the simulated robot (deliverable section 4.5)."""

import json
import math
import re
import time
from collections.abc import Iterator
from typing import Any

import pytest

from fakes.rapps import install_rapp
from fakes.whole_robot import WholeRobot, entered, whole_robot
from rapp_core.services.table import CORE_SERVICES

pytestmark = pytest.mark.timeout(180)
PATIENCE = 90.0  # s
NAME = "everything"
BODY = """
    const facts = {};
    const refusal = async (work) => {
      try { await work; return "it did"; } catch (error) { return `${error.name}: ${error.message}`; }
    };
    await communication.textToSpeech("say a name");
    facts.word = await communication.wordSpotting(["clock", "Elizabeth"], 60);
    facts.none = await communication.wordSpotting(["clock"], 0.3);
    facts.recording = await communication.captureAudio(0.2);
    facts.greeting = await communication.captureAudioUntilSilence("greeting.ogg", 0.2);
    await communication.playAudio(facts.greeting, 0.05, 0.5, -1);
    await navigation.setGlobalPose({ x: 2, y: 1, theta: Math.PI / 2 });
    await navigation.moveTo(0.1, 0, 0.2);
    facts.pose = await navigation.getRobotPose();
    await navigation.moveAlongPath([{ x: 0.05, y: 0, frame: "base_link" }]);
    await navigation.moveVel(0.05, 0, 0.1);
    await navigation.moveStop();
    await navigation.moveJoint(["HeadYaw", "HeadPitch"], [0.5, 0], 1);
    facts.head = await navigation.getTransform("Head", navigation.TORSO);
    await navigation.takePredefinedPosture("StandInit", 1);
    await navigation.lookAtPoint(1, 0.3, 0.4);
    const picture = await vision.captureImage("bottom", vision.QQVGA);
    facts.picture = [picture.width, picture.height, picture.data.length];
    await vision.setCameraParam(vision.TOP, 0, 60);
    facts.accepted = await vision.setCameraParams(vision.BOTTOM, [0, 99, 1], [60, 1, 1000]);
    await navigation.rest();
    facts.wrong = [
      await refusal(communication.textToSpeech(" ")),
      await refusal(navigation.moveTo(NaN, 0, 0)),
      await refusal(navigation.moveTo(1)),
      await refusal(navigation.moveTo(11, 0, 0)),
      await refusal(navigation.moveTo("far", 0, 0)),
      await refusal(navigation.moveJoint("Tail", 0)),
      await refusal(navigation.takePredefinedPosture("Headstand")),
      await refusal(vision.captureImage("left")),
      await refusal(keepsakes.keep("../passwd", "")),
    ];
    await keepsakes.keep("facts.json", JSON.stringify(facts));
"""


@pytest.fixture(scope="module")
def facts(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Any]]:
    """What the RApp has found out."""
    robot = WholeRobot(tmp_path_factory.mktemp("js"), body=True)
    core = [*(row.name for row in CORE_SERVICES), "rapp_keep"]
    install_rapp(robot.home, NAME, BODY, runtime="javascript", permissions={"core": core, "cloud": []})
    with whole_robot(robot, "roscore", "nao_sim", "core_agent"):
        robot.ask(NAME)
        speak_until_it_is_heard(robot)
        robot.until(entered("s10"), seconds=PATIENCE)
        (kept,) = robot.home.rglob("facts.json")
        yield json.loads(kept.read_text())


def speak_until_it_is_heard(robot: WholeRobot) -> None:
    deadline = time.monotonic() + PATIENCE
    while not any(seen.kind == "heard" and seen.detail == "Elizabeth" for seen in robot.seen):
        assert time.monotonic() < deadline, robot.story()
        robot.say("elizabeth")
        time.sleep(0.2)


def test_it_hears_and_records(facts: dict[str, Any]) -> None:
    assert (facts["word"], facts["none"]) == ("Elizabeth", "Empty")
    assert facts["recording"].endswith(".ogg")
    assert facts["greeting"].endswith("/greeting.ogg")


def test_it_walks_and_knows_where_it_is(facts: dict[str, Any]) -> None:
    pose = facts["pose"]
    assert (pose["x"], pose["y"], pose["theta"]) == pytest.approx((2.0, 1.1, math.pi / 2 + 0.2), abs=0.05)
    assert pose["frame"] == "map"
    head = facts["head"]
    assert math.atan2(head[1][0], head[0][0]) == pytest.approx(0.5, abs=0.05)
    assert head[3] == [0, 0, 0, 1]


def test_it_sees(facts: dict[str, Any]) -> None:
    assert facts["picture"] == [160, 120, 160 * 120 * 3]
    assert facts["accepted"] == [True, False, False]


def test_calls_of_no_use_are_told_apart_as_in_python(facts: dict[str, Any]) -> None:
    wanted = [
        "Invalid: .*text", "Invalid: .*number", "Invalid: .*y is missing", "Refused: .*10 m", "Invalid: ", "Invalid: .*HeadYaw",
        "Invalid: .*Crouch", "Invalid: .*top, bottom", "Invalid: .*name a file",
    ]  # fmt: skip
    assert [
        (words, said) for words, said in zip(wanted, facts["wrong"], strict=True) if not re.match(f"{words}", said, re.DOTALL)
    ] == []
    assert all(": cannot " in said for said in facts["wrong"])
