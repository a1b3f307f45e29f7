"""Walking in the running world, faster than a robot: where it comes, how it stops, what stops it."""

import math
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.model import BODY
from rapp_nao_sim.world.poses import Pose, compose, relative
from rapp_nao_sim.world.process import WorldClient, WorldConfig

PATIENCE = 30.0  # s
PACE = 3.0  # simulated seconds per second, as far as the machine can
BARE = Path(__file__).with_name("bare.toml")
FULL = (1.0, 0.02)  # share of full speed, lift of the feet


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def off(world: WorldClient, start: Pose, way: Pose) -> tuple[float, float]:
    """How far (m, rad) the robot is from where a way from a pose leads."""
    x, y, turn = relative(compose(start, way), world.robot_pose())
    return math.hypot(x, y), abs(turn)


@pytest.fixture(scope="module")
def standing() -> Iterator[WorldClient]:
    with WorldClient(WorldConfig(room=BARE, pace=PACE)) as world:
        yield world


@pytest.mark.parametrize("way", [(0.4, 0.0, 0.0), (0.0, 0.0, -1.2), (-0.1, 0.15, 0.4)])
def test_the_robot_arrives_where_it_is_sent(world: WorldClient, way: Pose) -> None:
    start, believed = world.robot_pose(), world.odometry()
    assert world.walk_to([way], *FULL)
    distance, turn = off(world, start, way)
    assert distance < 0.02 + 0.02 * math.hypot(*way[:2])
    assert turn < 0.05
    assert relative(compose(believed, way), world.odometry()) == pytest.approx((0, 0, 0), abs=0.02)
    assert not world.fallen() and not world.walking()
    assert max(map(abs, world.velocity())) < 0.05


def test_it_passes_the_points_of_a_way(world: WorldClient) -> None:
    start = world.robot_pose()
    passed: list[float] = []
    walking = threading.Thread(target=lambda: world.walk_to([(0.25, 0.0, 0.0), (0.25, 0.2, 1.5)], *FULL))
    walking.start()
    while walking.is_alive():
        passed.append(off(world, start, (0.25, 0.0, 0.0))[0])
        time.sleep(0.02)
    assert min(passed) < 0.08
    assert off(world, start, (0.25, 0.2, 1.5)) == pytest.approx((0, 0), abs=0.05)


def test_it_walks_at_a_velocity_and_stops_at_once_on_its_feet(world: WorldClient) -> None:
    start = world.robot_pose()
    world.walk_at((0.06, 0.0, 0.0), *FULL)
    until(lambda: relative(start, world.robot_pose())[0] > 0.12)
    assert world.velocity() == pytest.approx((0.06, 0.0, 0.0))
    here = world.robot_pose()
    world.stop_walk()
    until(lambda: not world.walking())
    assert off(world, here, (0.0, 0.0, 0.0))[0] < 0.06 * 0.3 + 0.02  # of the speed and the time to stop; a foot was ahead
    here = world.robot_pose()
    time.sleep(0.5)
    assert off(world, here, (0.0, 0.0, 0.0)) == pytest.approx((0, 0), abs=0.01)
    assert world.posture()[1] == "Standing" and not world.fallen()


@pytest.mark.parametrize("posture", ["Stand", "StandInit"])
def test_a_walk_that_is_stopped_at_its_very_beginning_leaves_it_on_its_feet(world: WorldClient, posture: str) -> None:
    for after in (0.0, 0.1, 0.25, 0.5, 0.8, 1.2):  # s: while it rises, sways, and makes its first steps
        world.set_posture(posture, 1.0)
        world.walk_at((0.09, 0.0, 0.0), *FULL)
        begun = world.clock()
        until(lambda end=begun + after: world.clock() >= end)
        world.stop_walk()
        world.wait_for_walk(PATIENCE)
        assert world.awake(), f"it fell when it was stopped after {after} s"
        assert not world.fallen()


def test_a_new_walk_replaces_the_old_one(world: WorldClient) -> None:
    results: list[bool] = []
    walking = threading.Thread(target=lambda: results.append(world.walk_to([(0.5, 0.0, 0.0)], *FULL)))
    walking.start()
    until(world.walking)
    time.sleep(0.3)
    here = world.robot_pose()
    assert world.walk_to([(0.0, 0.0, 0.6)], *FULL)
    walking.join(PATIENCE)
    assert results == [False]
    assert off(world, here, (0.0, 0.0, 0.6))[0] < 0.1
    world.walk_at((0.0, 0.0, 0.5), *FULL)
    time.sleep(0.3)
    world.walk_at((0.0, 0.0, 0.0), *FULL)
    world.wait_for_walk(PATIENCE)
    assert not world.walking()


def test_the_head_moves_while_it_walks_and_the_legs_are_refused(world: WorldClient) -> None:
    world.walk_at((0.0, 0.0, 0.3), *FULL)
    until(world.walking)
    world.set_joints(["HeadYaw", "LShoulderPitch"], [0.5, 0.8], 0.5)
    with pytest.raises(Refused, match="LKneePitch: the robot walks"):
        world.set_joints(["LKneePitch"], [0.5], 0.5)
    assert not world.busy(["RElbowYaw"]) and world.busy(["RAnkleRoll"])
    until(lambda: not world.busy(["HeadYaw", "LShoulderPitch"]))
    time.sleep(0.2)
    assert world.joint_angles(["HeadYaw", "LShoulderPitch"]) == pytest.approx([0.5, 0.8], abs=0.05)
    world.stop()
    until(lambda: not world.is_moving())


def test_it_does_not_walk_limp_or_sitting_or_to_nowhere(world: WorldClient) -> None:
    for wrong in ([], [(math.nan, 0.0, 0.0)], [(1e6, 0.0, 0.0)]):
        with pytest.raises(Refused):
            world.walk_to(wrong, *FULL)
    world.set_stiffness(BODY, [0.0] * len(BODY))
    with pytest.raises(Refused, match="wake the robot up"):
        world.walk_to([(0.1, 0.0, 0.0)], *FULL)
    world.set_stiffness(BODY, [1.0] * len(BODY))
    assert world.set_posture("Sit", 1.0)
    with pytest.raises(Refused, match="the robot is sitting"):
        world.walk_at((0.05, 0.0, 0.0), *FULL)
    assert not world.walking()


def test_a_push_in_the_walk_ends_it_and_the_robot_gets_up_and_walks_on(world: WorldClient) -> None:
    results: list[bool] = []
    walking = threading.Thread(target=lambda: results.append(world.walk_to([(0.6, 0.0, 0.0)], *FULL)))
    walking.start()
    until(world.walking)
    time.sleep(0.4)
    world.push([0.0, 60.0, 0.0], 0.2)
    until(world.fallen)
    walking.join(PATIENCE)
    assert results == [False]
    assert set(world.stiffnesses(BODY)) == {0.0}
    assert world.wake_up() and world.set_posture("StandInit", 1.0)
    start = world.robot_pose()
    assert world.walk_to([(0.1, 0.0, 0.0)], *FULL)
    assert off(world, start, (0.1, 0.0, 0.0))[0] < 0.03
