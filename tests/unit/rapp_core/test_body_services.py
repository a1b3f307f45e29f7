"""The services that move joints, take postures, tell places and take pictures: what they refuse, and what they ask of the robot."""

import math
from pathlib import Path
from typing import Any

import numpy
import pytest

from fakes.bench import Bench
from rapp_core.body_ports import Pose2D
from rapp_core.errors import Invalid, Refused, Unreachable
from rapp_core.services.calls import Call


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, posture_speed=0.6, joint_speed=0.3)


def joints(bench: Bench, angles: dict[str, float], speed: float = 0.0) -> None:
    bench.call("rapp_move_joint", joints=list(angles), angles=list(angles.values()), speed=speed)


def test_joints_are_moved_and_waited_for(bench: Bench) -> None:
    joints(bench, {"HeadYaw": 0.5, "LShoulderPitch": 1.0}, 0.5)
    assert bench.fake.journal == ["joints HeadYaw 0.50 LShoulderPitch 1.00 at 0.5"]
    assert bench.states() == ["/check", "/move"]
    assert bench.clock.time == pytest.approx(1.0, abs=0.05)


def test_no_speed_is_the_core_agent_s_own(bench: Bench) -> None:
    joints(bench, {"HeadYaw": 0.5})
    bench.call("rapp_take_predefined_posture", posture="Sit", speed=0.0)
    assert bench.fake.journal == ["joints HeadYaw 0.50 at 0.3", "posture Sit at 0.6"]


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ({"joints": ["Tail"], "angles": [0.1]}, "'Tail': this robot's joints are HeadYaw, HeadPitch"),
        ({"joints": ["HeadYaw"], "angles": [2.1]}, r"HeadYaw to 2\.1 rad: -2\.0857 to 2\.0857"),
        ({"joints": ["HeadYaw"], "angles": [math.nan]}, "HeadYaw"),
        ({"joints": ["HeadYaw"], "angles": [0.1, 0.2]}, "one angle"),
        ({"joints": ["HeadYaw", "HeadYaw"], "angles": [0.1, 0.2]}, "once"),
        ({"joints": [], "angles": []}, "name each joint"),
        ({"joints": ["HeadYaw"], "angles": [0.1], "speed": 1.1}, r"speed 1\.1"),
        ({"joints": ["HeadYaw"], "angles": [0.1], "speed": math.nan}, "speed nan"),
        ({"joints": ["HeadYaw"], "angles": [0.1], "speed": -0.1}, "speed"),
    ],
)
def test_joints_of_no_use_are_invalid_before_anything_moves(bench: Bench, request_: dict[str, Any], words: str) -> None:
    with pytest.raises(Invalid, match=words):
        bench.call("rapp_move_joint", **{"speed": 0.0, **request_})
    assert bench.fake.journal == []


def test_single_precision_does_not_put_a_joint_beyond_its_range(bench: Bench) -> None:
    joints(bench, {"HeadYaw": float(numpy.float32(2.0857))})
    assert bench.fake.motion.angle["HeadYaw"] == 2.0857


def test_joints_of_different_limbs_move_at_a_time(bench: Bench) -> None:
    bench.clock.at(0.5, lambda: joints(bench, {"LShoulderPitch": 1.0}))
    joints(bench, {"HeadYaw": 0.5})
    assert len(bench.fake.journal) == 2


@pytest.mark.parametrize(
    ("name", "request_", "told"),
    [
        ("rapp_move_joint", {"joints": ["HeadYaw"], "angles": [0.5], "speed": 0.0}, {"angles": (0.0,)}),
        ("rapp_take_predefined_posture", {"posture": "Sit", "speed": 0.0}, {"posture": "Unknown"}),
    ],
)
def test_a_goal_is_told_how_far_it_is(bench: Bench, name: str, request_: dict[str, Any], told: dict[str, Any]) -> None:
    seen: list[dict[str, Any]] = []
    bench.goal(name, Call(lambda values: seen.append(dict(values))), **request_)
    assert len(seen) >= 5
    assert all(each == told for each in seen)


def test_postures_that_are_not_known_are_invalid_and_the_known_named(bench: Bench) -> None:
    with pytest.raises(Invalid, match="'Headstand': known are Stand, StandInit"):
        bench.call("rapp_take_predefined_posture", posture="Headstand", speed=0.0)
    with pytest.raises(Invalid, match="'Stand': known are Sit, SitRelax, Crouch"):
        bench.call("rapp_rest", posture="Stand")
    assert bench.fake.journal == []


@pytest.mark.parametrize(("posture", "taken"), [("", "Sit"), ("Crouch", "Crouch")])
def test_rest_takes_a_posture_then_switches_the_motors_off(bench: Bench, posture: str, taken: str) -> None:
    bench.call("rapp_rest", posture=posture)
    assert bench.fake.journal == [f"posture {taken} at 0.6", "relax"]
    assert not bench.fake.motion.awake


def test_a_rest_that_is_stopped_leaves_the_motors_on(bench: Bench) -> None:
    bench.clock.at(1.0, lambda: bench.call("rapp_move_stop"))
    with pytest.raises(Refused, match="stopped"):
        bench.call("rapp_rest", posture="")
    assert bench.fake.motion.awake


def test_looks_at_a_point(bench: Bench) -> None:
    bench.call("rapp_look_at_point", x=1.0, y=0.5, z=0.4)
    assert bench.fake.journal == ["look 1 0.5 0.4 at 0.3"]


@pytest.mark.parametrize("wrong", [{"x": math.nan}, {"y": math.inf}, {"z": 101.0}])
def test_a_point_of_no_use_is_invalid(bench: Bench, wrong: dict[str, float]) -> None:
    with pytest.raises(Invalid):
        bench.call("rapp_look_at_point", **{"x": 1.0, "y": 0.0, "z": 0.0, **wrong})
    assert bench.fake.journal == []


def test_a_point_that_the_neck_does_not_reach_is_refused(bench: Bench) -> None:
    with pytest.raises(Refused, match="neck"):
        bench.call("rapp_look_at_point", x=-2.0, y=0.0, z=0.4)


def test_the_global_pose_is_kept_up_by_odometry(bench: Bench) -> None:
    bench.call("rapp_move_to", x=1.0, y=0.0, theta=math.pi / 2)
    bench.call("rapp_set_global_pose", pose=Pose2D(5.0, 5.0, math.pi))
    bench.call("rapp_move_to", x=1.0, y=0.0, theta=0.0)
    found = bench.call("rapp_get_robot_pose")["pose"]
    assert (found.x, found.y, abs(found.theta)) == pytest.approx((4.0, 5.0, math.pi))


def test_the_global_pose_outlives_the_rapp_that_told_it(bench: Bench) -> None:
    bench.call("rapp_set_global_pose", pose=Pose2D(5.0, 5.0, 0.0))
    bench.cut = bench.clock.event()
    assert bench.call("rapp_get_robot_pose")["pose"] == Pose2D(5.0, 5.0, 0.0)


@pytest.mark.parametrize("pose", [Pose2D(math.nan, 0.0, 0.0), Pose2D(0.0, math.inf, 0.0), Pose2D(0.0, 0.0, math.nan)])
def test_a_global_pose_of_no_use_is_invalid_and_changes_nothing(bench: Bench, pose: Pose2D) -> None:
    with pytest.raises(Invalid):
        bench.call("rapp_set_global_pose", pose=pose)
    assert bench.call("rapp_get_robot_pose")["pose"] == Pose2D(0.0, 0.0, 0.0)


def test_a_transform_has_sixteen_numbers(bench: Bench) -> None:
    assert bench.call("rapp_get_transform", name="CameraTop", space=2)["transform"][3] == 2.0


@pytest.mark.parametrize(("name", "space", "words"), [("CameraTop", 3, "0 torso, 1 world, 2 robot"), ("Tail", 0, "'Tail'")])
def test_a_transform_of_no_use_is_invalid(bench: Bench, name: str, space: int, words: str) -> None:
    with pytest.raises(Invalid, match=words):
        bench.call("rapp_get_transform", name=name, space=space)


@pytest.mark.parametrize(("resolution", "size"), [(0, (160, 120)), (1, (320, 240)), (2, (640, 480)), (3, (1280, 960))])
@pytest.mark.parametrize("camera", ["top", "bottom"])
def test_a_picture_is_of_the_camera_and_the_size_asked_for(
    bench: Bench, camera: str, resolution: int, size: tuple[int, int]
) -> None:
    picture = bench.call("rapp_capture_image", camera=camera, resolution=resolution)["frame"]
    assert (picture.width, picture.height, picture.camera) == (*size, camera)


@pytest.mark.parametrize(("camera", "resolution", "words"), [("left", 2, "top, bottom"), ("top", 4, "3 4VGA"), ("top", -1, "QVGA")])
def test_a_picture_of_no_use_is_invalid(bench: Bench, camera: str, resolution: int, words: str) -> None:
    with pytest.raises(Invalid, match=words):
        bench.call("rapp_capture_image", camera=camera, resolution=resolution)
    assert bench.fake.journal == []


def test_a_parameter_is_set_and_changes_the_picture(bench: Bench) -> None:
    bench.call("rapp_set_camera_param", camera=1, parameter=0, value=99)
    assert bench.call("rapp_capture_image", camera="bottom", resolution=0)["frame"].data[:3] == bytes([99, 0, 200])
    with pytest.raises(Refused):
        bench.call("rapp_set_camera_param", camera=1, parameter=0, value=256)
    with pytest.raises(Invalid, match="0 top, 1 bottom"):
        bench.call("rapp_set_camera_param", camera=2, parameter=0, value=1)


def test_of_several_parameters_each_is_reported(bench: Bench) -> None:
    reply = bench.call("rapp_set_camera_params", camera=0, parameters=(0, 99, 1), values=(70, 1, 20))
    assert reply["accepted"] == [True, False, True]
    assert "parameter 99" in reply["message"]
    assert (bench.fake.camera.values["top", 0], bench.fake.camera.values["top", 1]) == (70, 20)


@pytest.mark.parametrize(("parameters", "values"), [((0,), (1, 2)), ((), ()), ((0,) * 101, (1,) * 101)])
def test_parameters_of_no_use_are_invalid(bench: Bench, parameters: tuple[int, ...], values: tuple[int, ...]) -> None:
    with pytest.raises(Invalid, match="1 to 100"):
        bench.call("rapp_set_camera_params", camera=0, parameters=parameters, values=values)


STILL: dict[str, dict[str, Any]] = {
    "rapp_get_robot_pose": {},
    "rapp_get_transform": {"name": "CameraTop", "space": 0},
    "rapp_capture_image": {"camera": "top", "resolution": 0},
    "rapp_set_camera_param": {"camera": 0, "parameter": 0, "value": 1},
    "rapp_look_at_point": {"x": 1.0, "y": 0.0, "z": 0.0},
    "rapp_take_predefined_posture": {"posture": "Sit", "speed": 0.0},
    "rapp_rest": {"posture": ""},
}


@pytest.mark.parametrize("name", ["rapp_capture_image", "rapp_look_at_point", "rapp_take_predefined_posture", "rapp_rest"])
def test_a_robot_that_is_away_is_unreachable_and_works_again_when_it_is_back(bench: Bench, name: str) -> None:
    bench.fake.body.here = False
    with pytest.raises(Unreachable):
        bench.call(name, **STILL[name])
    bench.fake.body.here = True
    bench.call(name, **STILL[name])


@pytest.mark.parametrize("name", ["rapp_get_robot_pose", "rapp_get_transform", "rapp_capture_image", "rapp_set_camera_param"])
def test_what_moves_nothing_takes_no_time_beside_the_robot_s(bench: Bench, name: str) -> None:
    bench.call(name, **STILL[name])
    assert bench.clock.time == 0.0
