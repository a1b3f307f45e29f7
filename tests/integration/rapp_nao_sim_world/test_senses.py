"""What the body feels in the running world, and the events that it tells."""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.keys import values
from rapp_nao_sim.world.model import BODY
from rapp_nao_sim.world.process import WorldClient, WorldConfig

PATIENCE = 30.0  # s
DEVICE = "Device/SubDeviceList/"
WALL = 1.5  # m: x of its near side
BARE = Path(__file__).with_name("bare.toml")


@pytest.fixture(scope="module")
def standing() -> Iterator[WorldClient]:
    with WorldClient(WorldConfig(room=BARE, pace=3.0)) as world:
        yield world


def heard(world: WorldClient, enough: Callable[[list[tuple[str, Any]]], bool]) -> list[tuple[str, Any]]:
    """The events until there are enough."""
    events: list[tuple[str, Any]] = []
    deadline = time.monotonic() + PATIENCE
    while not enough(events):
        assert time.monotonic() < deadline, events
        events += world.events()
    return events


def test_a_standing_robot_feels_its_weight_and_the_vertical(world: WorldClient) -> None:
    time.sleep(0.3)
    felt = values(world.feelings())
    weight = sum(felt[f"{DEVICE}{side}Foot/FSR/TotalWeight/Sensor/Value"] for side in "LR")
    assert weight == pytest.approx(5.305, abs=0.3)
    assert min(felt[f"{DEVICE}{side}Foot/FSR/RearLeft/Sensor/Value"] for side in "LR") > 0.1
    pull = [felt[f"{DEVICE}InertialSensor/Accelerometer{axis}/Sensor/Value"] for axis in "XYZ"]
    assert pull == pytest.approx([0, 0, -9.81], abs=0.2)
    assert [felt[f"{DEVICE}InertialSensor/Angle{axis}/Sensor/Value"] for axis in "XY"] == pytest.approx([0, 0], abs=0.02)
    assert felt[f"{DEVICE}LKneePitch/Position/Sensor/Value"] == pytest.approx(-0.0923, abs=0.02)
    assert felt[f"{DEVICE}HeadYaw/Hardness/Actuator/Value"] == 1.0
    assert 25 < felt[f"{DEVICE}RHipRoll/Temperature/Sensor/Value"] < 60


def test_a_wall_is_heard_by_the_sonars_then_felt_and_stops_the_walk(world: WorldClient) -> None:
    x, _, _ = world.robot_pose()
    assert world.walk_to([(WALL - 0.7 - x, 0.0, 0.0)], 1.0, 0.02)
    world.set_sonar(True)
    felt = values(world.feelings())
    for side in ("Left", "Right"):
        # The cones look 22 degrees to the side: the nearest way to a wall ahead is inside them.
        assert felt[f"{DEVICE}US/{side}/Sensor/Value"] == pytest.approx(0.64, abs=0.05)
        assert felt[f"{DEVICE}US/{side}/Sensor/Value9"] == 5.0
    world.walk_at((0.09, 0.0, 0.0), 1.0, 0.02)
    events = heard(world, lambda events: any(key == "ALMotion/MoveFailed" for key, _ in events))
    names = [key for key, _ in events]
    assert names.index("SonarLeftDetected") < names.index("ALMotion/MoveFailed")
    assert {"LeftBumperPressed", "RightBumperPressed"} & set(names[: names.index("ALMotion/MoveFailed")])
    assert dict(events)["SonarRightDetected"] < 0.5
    world.set_sonar(False)
    world.wait_for_walk(PATIENCE)
    assert world.posture()[1] == "Standing" and not world.fallen()
    assert world.robot_pose()[0] > WALL - 0.2
    assert world.walk_to([(-0.15, 0.0, 0.0)], 1.0, 0.02)  # it can leave
    assert world.robot_pose()[0] < WALL - 0.2


def test_the_inertial_unit_follows_a_lying_robot(world: WorldClient) -> None:
    assert world.set_posture("LyingBack", 1.0)
    felt = values(world.feelings())
    assert felt[f"{DEVICE}InertialSensor/AngleY/Sensor/Value"] == pytest.approx(-math.pi / 2, abs=0.1)
    assert felt[f"{DEVICE}InertialSensor/AccelerometerX/Sensor/Value"] == pytest.approx(-9.8, abs=0.5)


def test_touches_are_told_in_their_order(world: WorldClient) -> None:
    world.touch("FrontTactil", 0.3)
    events = heard(world, lambda events: ("FrontTactilTouched", 0.0) in events)
    place = "Head/Touch/Front"
    told = [event for event in events if event[0] == "FrontTactilTouched" or event[1] in ([[place, True]], [[place, False]])]
    assert told == [
        ("FrontTactilTouched", 1.0),
        ("TouchChanged", [[place, True]]),
        ("FrontTactilTouched", 0.0),
        ("TouchChanged", [[place, False]]),
    ]
    world.touch("HandLeftBack", 600.0)
    heard(world, lambda events: ("HandLeftBackTouched", 1.0) in events)
    assert values(world.feelings())[f"{DEVICE}LHand/Touch/Back/Sensor/Value"] == 1.0
    world.touch("HandLeftBack", 0.01)
    for wrong in (("Tail", 1.0), ("FrontTactil", 0.0)):
        with pytest.raises(Refused):
            world.touch(*wrong)


def test_the_battery_tells_when_it_has_lost_a_percent(world: WorldClient) -> None:
    world.set_charge(0.405)
    world.set_charge(0.39)
    events = heard(world, lambda events: ("BatteryChargeChanged", 39) in events)
    assert ("BatteryChargeChanged", 40) in events
    assert values(world.feelings())[f"{DEVICE}Battery/Charge/Sensor/Value"] == pytest.approx(0.39, abs=0.01)
    with pytest.raises(Refused):
        world.set_charge(1.1)


def test_a_fall_is_told_as_it_begins_and_when_the_robot_lies(world: WorldClient) -> None:
    world.push([60.0, 0.0, 0.0], 0.2)
    events = heard(world, lambda events: ("robotHasFallen", True) in events)
    names = [key for key, _ in events]
    assert names.index("robotIsFalling") < names.index("robotHasFallen")
    assert set(world.stiffnesses(BODY)) == {0.0}
    assert world.fallen()


def test_a_robot_that_is_not_guarded_stays_stiff_in_a_fall(world: WorldClient) -> None:
    world.guard("falls", False)
    world.push([60.0, 0.0, 0.0], 0.2)
    heard(world, lambda events: ("robotHasFallen", True) in events)
    assert world.awake()
    world.guard("falls", True)
    with pytest.raises(Refused, match="bumpers, falls"):
        world.guard("moths", True)
