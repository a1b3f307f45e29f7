"""The body of a whole simulated robot through its NAOqi modules, as a client written for a real NAO uses them."""

import queue
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

SONAR = "Device/SubDeviceList/US/{}/Sensor/Value"
TIMEOUT = 60_000  # ms


@pytest.fixture
def robot(bare: Any) -> Any:
    return bare


@pytest.fixture
def motion(robot: Any) -> Any:
    motion = robot.service("ALMotion")
    motion.wakeUp()
    assert robot.service("ALRobotPosture").goToPosture("Stand", 1.0)
    return motion


@pytest.fixture
def memory(robot: Any) -> Any:
    return robot.service("ALMemory")


def subscribe(memory: Any, key: str) -> tuple[Any, "queue.Queue[Any]"]:
    """A subscriber, to be kept, and what it hears."""
    heard: queue.Queue[Any] = queue.Queue()
    subscriber = memory.subscriber(key)
    subscriber.signal.connect(heard.put)
    return subscriber, heard


def test_a_walk_is_waited_for_or_not(motion: Any, robot: Any) -> None:
    before = motion.getRobotPosition(True)
    waiting = motion.moveTo(0.1, 0.0, 0.0, _async=True)
    while not motion.moveIsActive():
        time.sleep(0.01)
    assert motion.getNextRobotPosition()[0] >= before[0] - 0.01
    assert waiting.value(TIMEOUT) is True
    assert motion.moveIsActive() is False
    after = motion.getRobotPosition(True)
    assert after[0] - before[0] == pytest.approx(0.1, abs=0.02)
    assert motion.getRobotPosition(False) == pytest.approx(after, abs=0.01)
    true = robot.service("SimWorld").getRobotPose()
    assert true == pytest.approx(after, abs=0.03)  # in this room the robot begins at 0


def test_velocities_and_the_end_of_a_walk(motion: Any, wait_for: Callable[..., None]) -> None:
    motion.moveToward(0.0, 0.0, 1.0, [["MaxStepFrequency", 0.5]])
    wait_for(lambda: motion.getRobotVelocity() == pytest.approx([0.0, 0.0, 0.25], abs=1e-6))
    motion.stopMove()
    motion.waitUntilMoveIsFinished()
    assert motion.moveIsActive() is False
    assert dict(motion.getMoveConfig("Max"))["MaxStepX"] == 0.08


@pytest.mark.parametrize(
    ("method", "args", "said"),
    [
        ("moveTo", (1.0, 2.0), "give x, y and theta"),
        ("moveTo", ("far", 0.0, 0.0), "as a number"),
        ("moveToward", (2.0, 0.0, 0.0), "from -1 to 1"),
        ("move", (0.1, 0.0, 0.0, [["Speed", 1]]), "known are MaxStepX"),
        ("getTransform", ("Tail", 0, True), "cannot find 'Tail'"),
        ("getPosition", ("Head", 7, True), "cannot use frame 7"),
        ("setCollisionProtectionEnabled", ("Tail", True), "known are Arms"),
    ],
)
def test_wrong_calls_are_refused_before_anything_moves(
    motion: Any, failing: Callable[..., Any], method: str, args: tuple[Any, ...], said: str
) -> None:
    with failing(f"ALMotion::{method}", said):
        getattr(motion, method)(*args)
    assert motion.moveIsActive() is False


def test_a_limp_robot_does_not_walk(motion: Any, failing: Callable[..., Any]) -> None:
    motion.rest()
    with failing("ALMotion::moveTo", "wake the robot up first"):
        motion.moveTo(0.1, 0.0, 0.0)


def test_looking_at_a_point_brings_it_onto_the_cameras_axis(motion: Any, robot: Any) -> None:
    point = [1.0, 0.4, 0.2]
    assert robot.service("ALTracker").lookAt(point, 2, 0.5, False) is True
    time.sleep(0.3)
    camera = np.array(motion.getTransform("CameraTop", 2, True)).reshape(4, 4)
    seen = np.linalg.inv(camera) @ [*point, 1.0]
    assert abs(seen[1] / seen[0]) < 0.01 and abs(seen[2] / seen[0]) < 0.01
    assert robot.service("ALTracker").lookAt([-1.0, 0.0, 0.3], 2, 0.5, False) is False


def test_an_arm_does_not_go_into_the_body(motion: Any) -> None:
    names = ["LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll"]
    goal = [1.5, -0.31, 0.0, -1.5]
    motion.angleInterpolationWithSpeed(names, goal, 0.4)
    assert motion.getAngles(names, False) != pytest.approx(goal, abs=0.1)
    motion.setCollisionProtectionEnabled("Arms", False)
    motion.angleInterpolationWithSpeed(names, goal, 0.4)
    assert motion.getAngles(names, False) == pytest.approx(goal, abs=0.01)
    motion.setCollisionProtectionEnabled("Arms", True)


def test_sonars_measure_while_somebody_is_subscribed(memory: Any, robot: Any, motion: Any, failing: Callable[..., Any]) -> None:
    sonar = robot.service("ALSonar")
    sonar.subscribe("test", 100, 0.0)
    left, right, nothing = memory.getListData([SONAR.format("Left"), SONAR.format("Right"), "NoSuchKey"])
    true = robot.service("SimWorld").getRobotPose()
    assert [left, right] == pytest.approx([1.5 - true[0] - 0.06] * 2, abs=0.1)
    assert nothing is None
    assert sonar.getFilteredValues() == [right, left]
    sonar.updatePeriod("test", 200)
    sonar.updatePrecision("test", 0.5)
    assert sonar.getSubscribersInfo() == [["test", 200, 0.5]]
    assert sonar.getCurrentPeriod() == 100
    sonar.unsubscribe("test")
    with failing("ALSonar::unsubscribe", "is not subscribed"):
        sonar.unsubscribe("test")


def test_keys_are_fresh(memory: Any, motion: Any) -> None:
    motion.angleInterpolation("HeadYaw", 0.4, 0.3, True)
    time.sleep(0.3)
    assert memory.getData("Device/SubDeviceList/HeadYaw/Position/Sensor/Value") == pytest.approx(0.4, abs=0.02)
    motion.setStiffnesses("Head", 0.0)
    time.sleep(0.05)
    assert memory.getData("Device/SubDeviceList/HeadYaw/Hardness/Actuator/Value") == 0.0
    assert "Device/SubDeviceList/Battery/Charge/Sensor/Value" in memory.getDataList("Battery")
    assert memory.getData("FrontTactilTouched") in (0.0, 1.0)
    motion.setStiffnesses("Head", 1.0)


def test_touches_and_the_battery_raise_events(memory: Any, robot: Any) -> None:
    world = robot.service("SimWorld")
    _kept, touched = subscribe(memory, "MiddleTactilTouched")
    _kept_too, charge = subscribe(memory, "BatteryChargeChanged")
    world.touch("MiddleTactil", 0.2)
    assert [touched.get(timeout=10), touched.get(timeout=10)] == [1.0, 0.0]
    world.setBattery(0.2)
    assert charge.get(timeout=10) == 20
    assert robot.service("ALBattery").getBatteryCharge() == 20


def test_a_push_raises_the_events_of_a_fall(memory: Any, robot: Any, motion: Any) -> None:
    _kept, falling = subscribe(memory, "robotIsFalling")
    _kept_too, fallen = subscribe(memory, "robotHasFallen")
    robot.service("SimWorld").pushRobot(-60.0, 0.0, 0.2)
    assert falling.get(timeout=10) is True
    assert fallen.get(timeout=10) is True
    assert motion.robotIsWakeUp() is False
    assert robot.service("SimWorld").hasFallen() is True
    motion.setStiffnesses("Body", 1.0)
    assert robot.service("ALRobotPosture").goToPosture("Stand", 1.0) is True


def test_modules_are_told_of_events_in_their_order(memory: Any, robot: Any) -> None:
    told: queue.Queue[Any] = queue.Queue()

    class Listener:
        def on_event(self, _key: str, value: Any, _message: str) -> None:
            told.put(value)

    robot.session.registerService("Listener", Listener())
    memory.subscribeToEvent("Counted", "Listener", "on_event")
    for number in range(50):
        memory.raiseEvent("Counted", number)
    assert [told.get(timeout=10) for _ in range(50)] == list(range(50))


def test_the_sonar_tells_its_keys_and_events(robot: Any, memory: Any) -> None:
    sonar = robot.service("ALSonar")
    keys, events = sonar.getMemoryKeyList(), sonar.getEventList()
    assert keys == [SONAR.format(side) for side in ("Left", "Right")]
    assert set(keys) <= set(memory.getDataListName())
    assert set(events) <= set(sonar.getOutputNames())
    assert "SonarLeftNothingDetected" in events


def test_what_this_robot_does_not_do_can_be_switched_all_the_same(robot: Any) -> None:
    motion = robot.service("ALMotion")
    motion.setSmartStiffnessEnabled(False)
    motion.setBreathEnabled("Body", False)
    motion.setIdlePostureEnabled("Body", True)
    robot.service("ALRobotPosture").setMaxTryNumber(2)
