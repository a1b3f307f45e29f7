"""Frames of the body's parts."""

import math

import numpy as np
import pytest

from rapp_nao_sim.world import postures
from rapp_nao_sim.world.errors import Refused
from rapp_nao_sim.world.frames import FRAMES, ROBOT, TORSO, WORLD, Stance, gaze, six, transform

POSTURES = postures.load()
ZERO = {**dict.fromkeys(POSTURES["Stand"].angles, 0.0), "LElbowRoll": -0.0349, "RElbowRoll": 0.0349}


def standing(name: str = "StandInit", pose: tuple[float, float, float] = (0.0, 0.0, 0.0), **angles: float) -> Stance:
    posture = POSTURES[name]
    return Stance({**posture.angles, **angles}, (-math.sin(posture.pitch), 0.0, math.cos(posture.pitch)), pose)


def test_the_cameras_sit_where_the_data_sheet_says() -> None:
    stance = Stance(ZERO, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    assert six(transform("CameraTop", TORSO, stance)) == pytest.approx([0.05871, 0, 0.1265 + 0.06364, 0, 0.0209, 0])
    assert six(transform("CameraBottom", TORSO, stance))[4] == pytest.approx(0.6929)
    assert transform("Torso", ROBOT, stance)[:3, 3] == pytest.approx([0, 0, 0.085 + 0.1 + 0.1029 + 0.04511])


def test_the_robots_frame_is_on_the_floor_between_the_feet() -> None:
    stance = standing()
    left, right = (transform(name, ROBOT, stance) for name in ("LLeg", "RLeg"))
    assert left[:3, 3] == pytest.approx([0, 0.05, 0], abs=1e-4)
    assert right[:3, 3] == pytest.approx([0, -0.05, 0], abs=1e-4)
    assert left[:3, :3] == pytest.approx(np.eye(3), abs=1e-4)
    assert six(transform("Torso", ROBOT, stance))[4] == pytest.approx(0.1, abs=1e-6)


def test_the_world_is_the_robots_frame_turned_and_moved_by_the_odometry() -> None:
    stance = standing(pose=(1.0, 2.0, math.pi / 2))
    here, there = transform("CameraTop", ROBOT, stance), transform("CameraTop", WORLD, stance)
    assert there[:3, 3] == pytest.approx([1.0 - here[1, 3], 2.0 + here[0, 3], here[2, 3]])
    assert six(there)[5] == pytest.approx(math.pi / 2)


def test_a_lying_robot_has_a_frame_too() -> None:
    lying = Stance(POSTURES["LyingBack"].angles, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert transform("Torso", ROBOT, lying)[:3, 0] == pytest.approx([0, 0, 1])


@pytest.mark.parametrize("name", FRAMES)
def test_every_frame_is_a_rotation_and_a_place_within_reach(name: str) -> None:
    matrix = transform(name, TORSO, standing())
    assert matrix[:3, :3] @ matrix[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
    assert matrix[3] == pytest.approx([0, 0, 0, 1])
    assert np.linalg.norm(matrix[:3, 3]) < 0.5


def test_sides_mirror_each_other() -> None:
    stance = standing()
    for name in ("Arm", "Leg", "ElbowRoll"):
        left, right = transform(f"L{name}", TORSO, stance)[:3, 3], transform(f"R{name}", TORSO, stance)[:3, 3]
        assert right == pytest.approx(left * [1, -1, 1])
    assert transform("RFsrFL", TORSO, stance)[1, 3] > transform("RFsrFR", TORSO, stance)[1, 3]


@pytest.mark.parametrize("point", [(1.0, 0.0, 0.3), (0.5, 0.4, -0.1), (2.0, -1.5, 0.8), (0.3, 0.2, 0.1)])
def test_a_point_looked_at_is_on_the_cameras_axis(point: tuple[float, float, float]) -> None:
    yaw, pitch = gaze(point)
    camera = transform("CameraTop", TORSO, standing(HeadYaw=yaw, HeadPitch=pitch))
    seen = np.linalg.inv(camera) @ [*point, 1.0]
    assert seen[0] > 0
    assert seen[1:3] == pytest.approx([0, 0], abs=1e-6)


def test_what_is_unknown_is_refused() -> None:
    with pytest.raises(Refused, match=r"'Tail'.*CameraTop"):
        transform("Tail", TORSO, standing())
    with pytest.raises(Refused, match=r"1 \(world\)"):
        transform("Torso", 3, standing())
    with pytest.raises(Refused, match="inside the head"):
        gaze((0.0, 0.0, 0.13))
