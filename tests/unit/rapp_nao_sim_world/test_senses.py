"""What is made of contacts, echoes, tilt and joints before it reaches ALMemory."""

import math
from itertools import pairwise

import pytest

from rapp_nao_sim.world import feet, keys, postures, selfcollision, sonar
from rapp_nao_sim.world.falls import Falls
from rapp_nao_sim.world.keys import TOUCHES, Feelings
from rapp_nao_sim.world.model import BODY

POSTURES = postures.load()
DEVICE = "Device/SubDeviceList/"


def felt(**changes: object) -> dict[str, object]:
    """The keys of a robot that feels nothing special but some changes."""
    nothing: dict[str, object] = {
        **dict.fromkeys(("angles", "targets", "stiffness", "heat"), dict.fromkeys(BODY, 0.5)),
        **dict.fromkeys(("tilt", "turning", "pull"), (0.0, 0.0, 0.0)),
        "feet": {"L": (1.0, 2.0, 3.0, 4.0), "R": (0.0, 0.0, 0.0, 0.0)},
        "pressed": frozenset(),
        "charge": 0.5,
    }
    return keys.values(Feelings(**(nothing | changes)))  # type: ignore[arg-type]


def test_every_joint_and_sensor_has_its_key() -> None:
    values = felt()
    for name in BODY:
        for kind in ("Position/Sensor", "Position/Actuator", "Hardness/Actuator", "Temperature/Sensor"):
            assert values[f"{DEVICE}{name}/{kind}/Value"] == 0.5
    assert values[f"{DEVICE}LFoot/FSR/RearRight/Sensor/Value"] == 4.0
    assert values[f"{DEVICE}LFoot/FSR/TotalWeight/Sensor/Value"] == 10.0
    assert values[f"{DEVICE}Battery/Charge/Sensor/Value"] == 0.5
    assert values[f"{DEVICE}InertialSensor/GyroscopeZ/Sensor/Value"] == 0.0


def test_what_is_pressed_is_1_and_all_else_0() -> None:
    values = felt(pressed=frozenset({"Head/Touch/Front"}))
    places = [place for all_places, _ in TOUCHES.values() for place in all_places]
    assert len(places) == len(set(places)) == 3 + 1 + 4 + 6
    assert {place for place in places if values[f"{DEVICE}{place}/Sensor/Value"]} == {"Head/Touch/Front"}


def test_echoes_are_numbered_from_the_second() -> None:
    values = felt(echoes={"Left": (0.5, 1.0), "Right": (5.0, 5.0)})
    assert values[f"{DEVICE}US/Left/Sensor/Value"] == 0.5
    assert values[f"{DEVICE}US/Left/Sensor/Value1"] == 1.0
    assert values[f"{DEVICE}US/Right/Sensor/Value"] == 5.0


def test_near_hits_are_one_echo_and_the_nearest_comes_first() -> None:
    assert sonar.heard([1.23, 0.5, 0.52, 0.501])[:3] == (0.5, 1.23, 5.0)
    assert sonar.heard([]) == (5.0,) * 10
    assert sonar.heard([0.001])[0] == 0.01


@pytest.mark.parametrize("side", ["L", "R"])
def test_weight_is_shared_by_the_corners_near_it(side: str) -> None:
    ahead = feet.weights(side, [(0.0703, 0.0, -0.045, 1.0, 9.81)])
    assert sum(ahead) == pytest.approx(1.0)
    assert ahead[0] > 0.3 and ahead[1] > 0.3 and ahead[2:] == pytest.approx((0, 0))
    assert feet.weights(side, [(0.0, 0.0, -0.045, 0.0, 9.81)]) == (0.0,) * 4


def test_a_bumper_is_pressed_by_what_is_before_it() -> None:
    front, floor, heel = (0.105, 0.02, -0.03, 0.0, 5.0), (0.1, 0.02, -0.045, 1.0, 20.0), (-0.05, 0.0, -0.03, 0.1, 5.0)
    assert feet.bumped("L", [front]) == {"LFoot/Bumper/Left"}
    assert feet.bumped("R", [(0.105, -0.02, -0.03, 0.0, 5.0)]) == {"RFoot/Bumper/Right"}
    assert feet.bumped("L", [floor, heel]) == set()


def course(*moments: tuple[float, float, bool, bool]) -> list[str | None]:
    """What is told at moments: seconds, tilt, on its feet, still."""
    falls = Falls()
    return [falls.watch(*moment) for moment in moments]


def test_a_fall_is_told_when_it_begins_and_when_the_robot_lies() -> None:
    told = course(
        (0.0, 0.0, True, True), (1.0, 0.4, True, False), (1.2, 0.8, False, False), (1.4, 1.5, False, False), (1.8, 1.5, False, True)
    )  # fmt: skip
    assert told == [None, None, "falling", None, "fallen"]


def test_a_robot_that_never_comes_to_rest_has_fallen_too() -> None:
    assert course((0.0, 0.0, True, True), (0.2, 0.9, False, False), (5.0, 1.5, False, False))[-1] == "fallen"


def test_lying_down_slowly_or_lying_from_the_beginning_is_no_fall() -> None:
    assert course((0.0, 1.5, False, True), (1.0, 1.5, False, True)) == [None, None]
    assert course((0.0, 0.0, True, True), (9.0, 1.5, False, True), (10.0, 1.5, False, True)) == [None] * 3


@pytest.mark.parametrize("name", POSTURES)
def test_no_posture_has_an_arm_in_the_body_or_a_leg_in_the_other(name: str) -> None:
    assert all(selfcollision.depth(chain, POSTURES[name].angles) < 0 for chain in selfcollision.HELD)


def test_an_arm_stops_before_the_body_and_may_leave_it() -> None:
    free = dict(POSTURES["StandInit"].angles)
    inside = free | {"LShoulderPitch": 1.5, "LShoulderRoll": -0.31, "LElbowRoll": -1.5, "LElbowYaw": 0.0}
    deeper = inside | {"LShoulderRoll": -0.314}
    assert selfcollision.depth("LArm", inside) > 0.03
    assert selfcollision.held("LArm", free, inside) and selfcollision.held("LArm", inside, deeper)
    assert not selfcollision.held("LArm", inside, free) and not selfcollision.held("RArm", free, inside)


def test_legs_stop_at_each_other_and_may_part() -> None:
    free = dict(POSTURES["LyingBack"].angles)
    crossed = free | {"LHipRoll": -0.37, "RHipRoll": 0.37}
    deeper = crossed | {"RHipRoll": 0.379}
    assert selfcollision.held("Legs", free, crossed) and selfcollision.held("Legs", crossed, deeper)
    assert not selfcollision.held("Legs", crossed, free)


@pytest.mark.parametrize("name", POSTURES)
@pytest.mark.parametrize("other", POSTURES)
def test_joints_go_from_posture_to_posture_without_being_held_at_the_legs(name: str, other: str) -> None:
    start, goal = POSTURES[name].angles, POSTURES[other].angles
    way = [{joint: angle + (goal[joint] - angle) * part / 20 for joint, angle in start.items()} for part in range(21)]
    assert not [step for step, (here, there) in enumerate(pairwise(way)) if selfcollision.held("Legs", here, there)]


def test_arms_mirror_each_other() -> None:
    turned = {"LShoulderRoll": -0.3, "LElbowRoll": -1.0, "LElbowYaw": -0.4}
    mirrored = {"R" + name[1:]: -angle for name, angle in turned.items()}
    free = dict(POSTURES["StandInit"].angles)
    left, right = selfcollision.depth("LArm", free | turned), selfcollision.depth("RArm", free | mirrored)
    assert left == pytest.approx(right, abs=1e-6)
    assert not math.isclose(left, selfcollision.depth("LArm", free))
