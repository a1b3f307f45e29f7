"""ALMotion and ALRobotPosture, called over the qi protocol as a client of the robot does."""

import os
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi logs on standard output otherwise

import qi

from rapp_nao_sim.world.model import BODY, LINKS
from rapp_nao_sim.world.motion_modules import modules
from rapp_nao_sim.world.process import WorldClient

TIMEOUT = 20_000  # ms


@pytest.fixture(scope="module")
def session(standing: WorldClient) -> Iterator[Any]:
    host, client = qi.Session(), qi.Session()
    host.listenStandalone("tcp://127.0.0.1:0")
    for name, module in modules(standing).items():
        host.registerService(name, module)
    client.connect(host.url())
    yield client
    client.close()
    host.close()


@pytest.fixture
def motion(session: Any, world: WorldClient) -> Any:
    return session.service("ALMotion")


@pytest.fixture
def posture(session: Any, world: WorldClient) -> Any:
    return session.service("ALRobotPosture")


def test_the_body_is_described(motion: Any) -> None:
    assert motion.getBodyNames("Body") == BODY
    assert motion.getBodyNames("Head") == ["HeadYaw", "HeadPitch"]
    assert motion.getLimits("HeadYaw")[0][:2] == pytest.approx([-2.0857, 2.0857], abs=1e-3)
    assert len(motion.getLimits("Body")) == 26


def test_the_mass_of_the_body_and_its_parts(motion: Any) -> None:
    assert motion.getMass("Body") == pytest.approx(5.305, abs=0.01)
    assert motion.getMass("Com") == motion.getMass("Joints") == motion.getMass("Body")
    parts = [motion.getMass(name) for name in ("Torso", "Head", "LArm", "RArm", "LLeg", "RLeg")]
    assert sum(parts) == pytest.approx(motion.getMass("Body"))
    assert motion.getMass("HeadPitch") == pytest.approx(0.60533)
    with pytest.raises(RuntimeError, match=r"ALMotion::getMass\n\tcannot find joint 'Tail'"):
        motion.getMass("Tail")


def test_the_centre_of_mass_is_where_the_links_truly_are(motion: Any, posture: Any, world: WorldClient) -> None:
    assert posture.goToPosture("Sit", 1.0)
    motion.angleInterpolation(["LShoulderPitch", "HeadYaw"], [0.0, 0.5], 0.5, True)
    time.sleep(0.5)  # what moved comes to rest, between the two answers too
    told = motion.getCOM("Body", 0, True)
    moment, mass = np.zeros(4), 0.0
    for name, link in LINKS.items():
        moment += link.mass * np.array(world.link(name)).reshape(4, 4) @ [*link.centre, 1.0]
        mass += link.mass
    true = np.linalg.inv(np.array(world.link("torso")).reshape(4, 4)) @ (moment / mass)
    assert told == pytest.approx(true[:3], abs=5e-4)
    left, right = motion.getCOM("LArm", 2, True), motion.getCOM("RArm", 2, True)
    assert left[1] > 0.05 > -0.05 > right[1]
    assert left[2] > 0.1


def test_the_summary_lists_joints_and_tasks(motion: Any) -> None:
    waiting = motion.angleInterpolation("HeadYaw", 1.0, 30.0, True, _async=True)
    number = the_task(motion)[1]
    rows = [line.split() for line in motion.getSummary().splitlines()]
    motion.killAll()
    waiting.value(TIMEOUT)
    assert [row[0] for row in rows[2:28]] == BODY
    knee = next(row for row in rows if row[0] == "LKneePitch")
    assert [float(value) for value in knee[1:]] == pytest.approx([1.0, *motion.getAngles("LKneePitch", False) * 2], abs=0.02)
    assert rows[-1] == ["angleInterpolation", str(number)]


def test_postures_by_name(posture: Any) -> None:
    assert posture.goToPosture("Sit", 1.0) is True
    assert (posture.getPosture(), posture.getPostureFamily()) == ("Sit", "Sitting")
    assert posture.goToPosture("Stand", 1.0) is True
    assert posture.getPosture() == "Stand"
    assert {"Stand", "Sit", "Crouch"} <= set(posture.getPostureList())
    assert "Standing" in posture.getPostureFamilyList()
    with pytest.raises(RuntimeError, match=r"ALRobotPosture::goToPosture\n\tcannot take posture 'Handstand'"):
        posture.goToPosture("Handstand", 1.0)


def test_applying_a_posture_near_the_present_one(posture: Any, motion: Any) -> None:
    motion.angleInterpolationWithSpeed("HeadYaw", 0.5, 1.0)
    assert posture.applyPosture("Stand", 1.0) is True
    assert motion.getAngles("HeadYaw", False) == pytest.approx([0.0])


def test_angles_are_set_changed_and_interpolated(motion: Any) -> None:
    motion.angleInterpolation(["HeadYaw", "HeadPitch"], [0.3, 0.1], 0.3, True)
    assert motion.getAngles("Head", False) == pytest.approx([0.3, 0.1])
    assert motion.getAngles("Head", True) == pytest.approx([0.3, 0.1], abs=0.05)
    motion.angleInterpolation("HeadYaw", [[0.1, -0.1]], [[0.2, 0.4]], False)
    assert motion.getAngles("HeadYaw", False) == pytest.approx([0.2])
    motion.setAngles("LHand", 1.0, 0.5)
    motion.changeAngles("HeadYaw", -0.2, 0.5)
    while not motion.areResourcesAvailable(["HeadYaw", "LHand"]):
        time.sleep(0.02)
    assert motion.getAngles(["HeadYaw", "LHand"], False) == pytest.approx([0.0, 1.0])


def test_stopping_ends_what_another_call_waits_for(motion: Any) -> None:
    waiting = motion.angleInterpolation("HeadYaw", 1.0, 30.0, True, _async=True)
    while motion.areResourcesAvailable("HeadYaw"):
        time.sleep(0.02)
    assert motion.moveIsActive() is False  # that is for walking
    motion.killTasksUsingResources(["HeadYaw"])
    waiting.value(TIMEOUT)
    assert motion.areResourcesAvailable("HeadYaw")
    assert motion.getAngles("HeadYaw", False)[0] < 0.9


def test_stiffness(motion: Any) -> None:
    motion.setStiffnesses("Head", 0.5)
    assert motion.getStiffnesses("Head") == [0.5, 0.5]
    motion.stiffnessInterpolation("Head", 1.0, 0.2)
    assert motion.getStiffnesses("Head") == [1.0, 1.0]


def test_rest_and_wake_up(motion: Any, posture: Any) -> None:
    assert motion.robotIsWakeUp() is True
    motion.rest()
    assert motion.robotIsWakeUp() is False
    assert set(motion.getStiffnesses("Body")) == {0.0}
    motion.wakeUp()
    assert motion.robotIsWakeUp() is True
    assert posture.getPosture() == "StandInit"


def test_the_robots_own_frame_starts_where_it_does(motion: Any) -> None:
    assert motion.getRobotPosition(True) == pytest.approx([0, 0, 0], abs=0.05)
    assert motion.getRobotVelocity() == pytest.approx([0, 0, 0], abs=0.05)


@pytest.mark.parametrize(
    ("method", "args", "said"),
    [
        ("getAngles", ("Tail", True), "cannot find joint 'Tail'"),
        ("setAngles", ("Head", [0.1], 0.5), "1 values for 2 joints"),
        ("setAngles", ("HeadYaw", "left", 0.5), "as a number"),
        ("setAngles", ("HeadYaw", 0.1, 2.0), "cannot move at 2"),
        ("angleInterpolation", ("HeadYaw", 0.1, 1e6, True), "divide the movement"),
        ("angleInterpolation", ("HeadYaw", 0.1, -1.0, True), "rising times"),
        ("stiffnessInterpolation", ("HeadYaw", 0.1, -1.0), "cannot take times"),
    ],
)
def test_wrong_calls_are_answered_with_the_reason(motion: Any, method: str, args: tuple[Any, ...], said: str) -> None:
    with pytest.raises(RuntimeError, match=f"ALMotion::{method}") as caught:
        getattr(motion, method)(*args)
    assert said in str(caught.value)


def test_tasks_are_listed_and_ended_one_by_one(motion: Any, posture: Any) -> None:
    assert motion.getTaskList() == []
    head = motion.angleInterpolation(["HeadYaw", "HeadPitch"], [1.0, 0.1], 30.0, True, _async=True)
    arm = motion.angleInterpolation("LElbowYaw", -0.5, 30.0, True, _async=True)
    while len(motion.getTaskList()) < 2:
        time.sleep(0.02)
    tasks = {tuple(joints): (name, number) for name, number, _broker, _priority, joints in motion.getTaskList()}
    assert {name for name, _number in tasks.values()} == {"angleInterpolation"}
    assert motion.killTask(tasks["HeadYaw", "HeadPitch"][1]) is True
    head.value(TIMEOUT)
    assert not arm.isFinished()
    assert motion.killTask(tasks["HeadYaw", "HeadPitch"][1]) is False
    assert [task[4] for task in motion.getTaskList()] == [["LElbowYaw"]]
    motion.killAll()
    arm.value(TIMEOUT)


def the_task(motion: Any) -> Any:
    """The only one, as soon as there is one."""
    until = time.monotonic() + TIMEOUT / 1000
    while not (tasks := motion.getTaskList()):
        assert time.monotonic() < until
    (task,) = tasks
    return task


def test_a_walk_and_a_change_of_posture_are_tasks(motion: Any, posture: Any) -> None:
    walk = motion.moveTo(40.0, 0.0, 0.0, _async=True)
    name, number, _broker, _priority, joints = the_task(motion)
    assert name == "move"
    assert "LKneePitch" in joints
    assert motion.killTask(number) is True
    assert walk.value(TIMEOUT) is False
    motion.waitUntilMoveIsFinished()
    change = posture.goToPosture("Sit", 0.002, _async=True)
    name, number, *_rest = the_task(motion)
    assert name == "goToPosture"
    assert motion.killTask(number) is True
    assert change.value(TIMEOUT) is False
    assert posture.goToPosture("Stand", 1.0)
