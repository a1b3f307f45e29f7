"""The body in the running world: it stands, moves, rests and falls as a robot does."""

import threading
import time
from collections.abc import Callable

import numpy as np
import pytest

from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.model import BODY, JOINTS
from rapp_nao_sim.world.postures import load
from rapp_nao_sim.world.process import WorldClient

PATIENCE = 20.0  # s


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_the_robot_stands_still_where_the_room_file_says(world: WorldClient) -> None:
    before = world.robot_pose()
    time.sleep(2.0)
    assert world.robot_pose() == pytest.approx(before, abs=2e-3)
    assert world.posture() == ("Stand", "Standing")
    assert world.velocity() == pytest.approx((0, 0, 0), abs=0.01)
    assert not world.fallen()
    angles, wanted = world.joint_angles(BODY), load()["Stand"].angles
    assert angles == pytest.approx([wanted[name] for name in BODY], abs=0.02)


@pytest.mark.parametrize("name", ["Sit", "LyingBack", "Crouch"])
def test_postures_are_taken_and_left_again(world: WorldClient, name: str) -> None:
    assert world.set_posture(name, 1.0)
    assert world.posture()[0] == name
    assert not world.fallen()
    assert world.set_posture("Stand", 1.0)
    assert world.posture() == ("Stand", "Standing")
    assert not world.is_moving()


def test_joints_go_where_they_are_sent_and_no_farther_than_they_can(world: WorldClient) -> None:
    world.set_joints(["HeadYaw", "LShoulderPitch"], [0.5, 9.0], 0.5)
    assert world.is_moving()
    until(lambda: not world.is_moving())
    time.sleep(0.2)
    expected = [0.5, JOINTS["LShoulderPitch"].upper]
    assert world.commanded_angles(["HeadYaw", "LShoulderPitch"]) == pytest.approx(expected)
    assert world.joint_angles(["HeadYaw", "LShoulderPitch"]) == pytest.approx(expected, abs=0.02)


def test_the_hips_twin_joints_move_as_one(world: WorldClient) -> None:
    assert world.move_joints(["LHipYawPitch"], [[-0.3]], [[0.3]])
    left, right = world.commanded_angles(["LHipYawPitch", "RHipYawPitch"])
    assert left == right == pytest.approx(-0.3)


def test_a_leg_stops_at_the_other(world: WorldClient) -> None:
    hips = ["LHipRoll", "RHipRoll"]
    assert world.set_posture("LyingBack", 1.0)
    world.move_joints(hips, [[0.0], [0.0]], [[0.5], [0.5]])
    assert world.commanded_angles(hips) == pytest.approx([0.0, 0.0])
    world.move_joints(hips, [[-0.37], [0.37]], [[1.0], [1.0]])
    time.sleep(0.3)
    torso = np.linalg.inv(np.array(world.link("torso")).reshape(4, 4))
    left, right = ((torso @ np.array(world.link(name)).reshape(4, 4))[1, 3] for name in ("LAnkle", "RAnkle"))
    assert left > right + 0.03
    world.move_joints(hips, [[0.1], [-0.1]], [[0.5], [0.5]])
    assert world.commanded_angles(hips) == pytest.approx([0.1, -0.1])


def test_an_interpolation_ends_at_its_last_point(world: WorldClient) -> None:
    assert world.move_joints(["HeadYaw", "HeadPitch"], [[0.4, -0.4], [0.2]], [[0.2, 0.5], [0.3]])
    assert world.commanded_angles(["HeadYaw", "HeadPitch"]) == pytest.approx([-0.4, 0.2])


def test_stop_ends_a_change_of_posture_and_tells_who_waits(world: WorldClient) -> None:
    results: list[bool] = []
    waiting = threading.Thread(target=lambda: results.append(world.set_posture("Crouch", 0.05)))
    waiting.start()
    until(world.is_moving)
    time.sleep(0.3)
    world.stop()
    waiting.join(PATIENCE)
    assert results == [False]
    assert not world.is_moving()
    still = world.joint_angles(["LKneePitch"])
    time.sleep(0.3)
    assert world.joint_angles(["LKneePitch"]) == pytest.approx(still, abs=0.02)
    assert still[0] < 1.0  # a crouch needs more than 2 rad


def test_a_newer_command_for_a_joint_ends_the_older(world: WorldClient) -> None:
    results: list[bool] = []
    waiting = threading.Thread(target=lambda: results.append(world.move_joints(["HeadYaw"], [[1.0]], [[30.0]])))
    waiting.start()
    until(world.is_moving)
    world.set_joints(["HeadYaw"], [0.0], 1.0)
    waiting.join(PATIENCE)
    assert results == [False]


def test_rest_crouches_and_removes_the_stiffness_and_waking_up_stands(world: WorldClient) -> None:
    assert world.rest()
    assert not world.awake()
    assert set(world.stiffnesses(BODY)) == {0.0}
    with pytest.raises(Refused, match="wake the robot up"):
        world.set_posture("Stand", 1.0)
    time.sleep(1.0)
    assert world.posture()[1] == "Standing" and not world.fallen()
    knees = world.joint_angles(["LKneePitch"])
    world.set_joints(["LKneePitch"], [0.0], 1.0)
    until(lambda: not world.is_moving())
    assert world.joint_angles(["LKneePitch"]) == pytest.approx(knees, abs=0.1)
    assert world.wake_up()
    assert world.awake()
    assert world.posture() == ("StandInit", "Standing")


def test_without_stiffness_a_robot_on_bent_knees_sinks(world: WorldClient) -> None:
    assert world.set_posture("StandInit", 1.0)
    world.set_stiffness(BODY, [0.0] * len(BODY))
    until(lambda: world.posture()[0] != "StandInit")


def test_a_hard_push_throws_the_robot_over_and_it_gets_up(world: WorldClient) -> None:
    time.sleep(1.0)  # nothing happens for so long that the physics rests
    world.push([60.0, 0.0, 0.0], 0.2)
    until(world.fallen)
    assert world.posture()[1].startswith("Lying")
    assert set(world.stiffnesses(BODY)) == {0.0}
    assert world.wake_up()
    assert world.set_posture("Stand", 1.0)
    assert not world.fallen()


def test_what_cannot_be_done_is_refused_with_its_reason(world: WorldClient) -> None:
    with pytest.raises(Refused, match="'Tail'"):
        world.joint_angles(["Tail"])
    with pytest.raises(Refused, match="'Tail'"):
        world.set_joints(["Tail"], [0.0], 0.5)
    with pytest.raises(Refused, match="known are Stand"):
        world.set_posture("Handstand", 0.5)
    for speed in (0.0, 1.5):
        with pytest.raises(Refused):
            world.set_posture("Sit", speed)
        with pytest.raises(Refused):
            world.set_joints(["HeadYaw"], [0.0], speed)
    with pytest.raises(Refused, match="rising times"):
        world.move_joints(["HeadYaw"], [[0.1, 0.2]], [[0.5, 0.5]])
    with pytest.raises(Refused):
        world.set_joints(["HeadYaw", "HeadPitch"], [0.0], 0.5)
    with pytest.raises(Refused, match="lamp"):
        world.set_lamp(2.0)
    with pytest.raises(Refused, match="door"):
        world.set_door(7.0)
    with pytest.raises(Refused, match="push"):
        world.push([float("nan"), 0.0, 0.0], 0.1)
    assert not world.is_moving()


def test_many_threads_may_ask_at_once(world: WorldClient) -> None:
    answers: list[tuple[float, float, float]] = []
    threads = [threading.Thread(target=lambda: answers.extend(world.robot_pose() for _ in range(20))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    assert len(answers) == 160
