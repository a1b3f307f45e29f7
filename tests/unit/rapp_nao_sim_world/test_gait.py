"""The gait: where the feet go, and that the legs can bring them there."""

import math
from itertools import pairwise

import numpy as np
import pytest

from rapp_nao_sim.world import legs, odometry, postures
from rapp_nao_sim.world.gait import Gait, Stance, Style, even
from rapp_nao_sim.world.legs import Placement
from rapp_nao_sim.world.model import JOINTS
from rapp_nao_sim.world.poses import Pose, relative

PERIOD = 1 / 80
POSTURES = postures.load()
STAND = dict(POSTURES["StandInit"].angles)


def walk(gait: Gait, start: dict[str, float], ticks: int) -> list[dict[str, float]]:
    """The body's joints tick by tick, until it stands."""
    ways = []
    angles = dict(start)
    for _ in range(ticks):
        if gait.standing:
            break
        angles = angles | gait.tick(angles)
        ways.append(angles)
    return ways


def begun(start: dict[str, float], velocity: Pose, steps: int) -> tuple[Gait, list[dict[str, float]]]:
    """A walk of some steps, and its joints."""
    left = [velocity] * steps
    gait = Gait(start, Stance.of(start, (0.0, 0.0, 0.0)), lambda: left.pop() if left else None, PERIOD, Style())
    return gait, walk(gait, start, 4000)


def test_the_legs_reach_where_they_are_sent() -> None:
    left = Placement(legs.about_z(0.1), np.array([0.03, 0.06, -0.30]))
    right = Placement(legs.about_z(-0.1), np.array([-0.02, -0.05, -0.31]))
    angles = STAND | legs.reach(STAND, left, right, 10)
    for side, goal in (("L", left), ("R", right)):
        assert legs.sole(side, angles).position == pytest.approx(goal.position, abs=5e-4)
        assert legs.sole(side, angles).rotation[:, 0] == pytest.approx(goal.rotation[:, 0], abs=0.02)
    assert angles["LHipYawPitch"] == angles["RHipYawPitch"]


def test_the_centre_of_mass_follows_the_arms() -> None:
    before = legs.centre_of_mass(STAND)
    after = legs.centre_of_mass(STAND | {"LShoulderPitch": 0.0, "RShoulderPitch": 0.0})
    assert before[1] == pytest.approx(0, abs=1e-9)
    assert after[0] > before[0] + 0.005 and after[2] > before[2]


@pytest.mark.parametrize(
    ("velocity", "moved"),
    [((0.09, 0.0, 0.0), (1, 0, 0)), ((-0.06, 0.0, 0.0), (-1, 0, 0)), ((0.0, 0.05, 0.0), (0, 1, 0)), ((0.0, 0.0, -0.5), (0, 0, -1))],
)
def test_steps_carry_the_robot_as_far_as_its_velocity_says(velocity: Pose, moved: tuple[int, int, int]) -> None:
    steps = 8
    gait, ways = begun(STAND, velocity, steps)
    assert gait.standing
    way = steps * Style().step
    gone = gait.middle()
    for part, speed, sign in zip(gone, velocity, moved, strict=True):
        # The first foot of a walk to the side closes up, the last one may still be out.
        assert part == pytest.approx(speed * way, abs=abs(speed) * Style().step + 0.01)
        assert part * sign > 0 or sign == 0
    assert all(JOINTS[name].lower <= angle <= JOINTS[name].upper for angles in ways for name, angle in angles.items())


def test_the_sensors_odometry_agrees_with_the_steps_that_were_planned() -> None:
    believed = odometry.Odometry()
    believed.begin(STAND)
    left: list[Pose] = [(0.05, 0.02, 0.2)] * 6
    gait = Gait(STAND, Stance.of(STAND, believed.pose), lambda: left.pop() if left else None, PERIOD, Style())
    angles = dict(STAND)
    while not gait.standing:
        support = gait.support
        angles |= gait.tick(angles)
        believed.follow(support, angles)
    assert believed.pose == pytest.approx(gait.middle(), abs=2e-3)


def test_joints_move_no_faster_than_their_motors_can() -> None:
    _, ways = begun(STAND, (0.06, 0.0, 0.1), 6)
    for one, other in pairwise(ways):
        for name, angle in other.items():
            assert abs(angle - one[name]) / PERIOD <= JOINTS[name].speed, name


@pytest.mark.parametrize("name", ["Stand", "StandInit", "StandZero", "Crouch"])
def test_a_walk_begins_from_every_standing_posture(name: str) -> None:
    start = dict(POSTURES[name].angles)
    assert even(start)
    gait, ways = begun(start, (0.05, 0.0, 0.0), 3)
    assert gait.standing
    steps = [max(abs(other[joint] - one[joint]) for joint in one) for one, other in pairwise(ways)]
    assert max(steps) < 0.1
    assert ways[0]["LKneePitch"] == pytest.approx(start["LKneePitch"], abs=0.1)
    for side in legs.SIDES:
        assert legs.sole(side, ways[-1]).rotation[2, 2] == pytest.approx(1, abs=1e-4)


def test_no_walk_begins_on_one_foot() -> None:
    assert not even(STAND | {"LKneePitch": 1.5})
    assert not even(STAND | {"RAnkleRoll": 0.3})


@pytest.mark.parametrize("ticks", [3, 40, 47, 60, 75, 90])
def test_a_walk_is_broken_off_within_a_fraction_of_a_second(ticks: int) -> None:
    start = dict(STAND)
    gait = Gait(start, Stance.of(start, (0.0, 0.0, 0.0)), lambda: (0.09, 0.0, 0.0), PERIOD, Style())
    ways = walk(gait, start, ticks)
    gait.stop()
    after = walk(gait, ways[-1], 1000)
    assert gait.standing
    assert len(after) * PERIOD < 0.25
    stance = Stance.of(after[-1], gait.middle())
    assert even(after[-1])
    gap = relative(stance.feet["R"], stance.feet["L"])
    assert gap[1] == pytest.approx(Style().apart, abs=0.01)
    assert math.hypot(*gap[:2]) < 0.15


def test_stopped_while_it_rises_the_legs_stay_where_they_are() -> None:
    start = dict(POSTURES["Stand"].angles)
    gait = Gait(start, Stance.of(start, (0.0, 0.0, 0.0)), lambda: (0.09, 0.0, 0.0), PERIOD, Style())
    risen = walk(gait, start, 5)[-1]
    assert not gait.standing
    gait.stop()
    assert walk(gait, risen, 100)[-1] == risen
    assert gait.standing
