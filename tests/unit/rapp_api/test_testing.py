"""The core agent for authors' tests refuses what the real one refuses."""

import json
import math
import time
from pathlib import Path

import numpy as np
import pytest
from rapp_msgs.msg import MoveJointGoal, MoveToGoal, TakePostureGoal

from rapp_api import Bug, Invalid, Pose, Refused, Unreachable, cloud, communication, keepsakes, navigation, vision
from rapp_api.core_agent import current
from rapp_api.testing import FakeCoreAgent


def test_it_answers_as_its_person_and_its_services_do() -> None:
    services = {"add": lambda arguments: arguments["a"] + arguments["b"], "away": Unreachable("cannot reach it")}
    with FakeCoreAgent(hears=["yes", "perhaps"], services=services) as core:
        assert communication.word_spotting(["Yes", "No"]) == "Yes"
        assert communication.word_spotting(["Yes", "No"]) == communication.EMPTY
        assert communication.word_spotting(["Yes", "No"]) == communication.EMPTY
        assert cloud.call_wait("add", {"a": 1, "b": 2}) == 3
        with pytest.raises(Unreachable):
            cloud.call_wait("away")
        with pytest.raises(Refused):
            cloud.call_wait("unknown")
        assert core.said() == []


def test_a_cloud_agent_answers_as_its_services_do_until_it_is_stopped(tmp_path: Path) -> None:
    services = {"look": lambda arguments: (arguments["picture"].name, arguments["times"])}
    answers: list[object] = []
    with FakeCoreAgent(agent_services=services) as core:
        assert cloud.call_agent_wait("look", {"picture": tmp_path / "door.jpg", "times": 2}) == ("door.jpg", 2)
        cloud.call_agent("look", {"picture": tmp_path / "x", "times": 1}, answers.append)
        while not answers:
            time.sleep(0.01)
        assert answers == [("x", 1)]
        assert cloud.stop_agent_wait()
        assert not cloud.stop_agent_wait()
        with pytest.raises(Refused):
            cloud.call_agent_wait("look", {"picture": tmp_path, "times": 2})
        assert [name for name, _ in core.calls] == ["agent_call", "agent_call", "stop_cloud_agent", "stop_cloud_agent"]
    with FakeCoreAgent(services=services), pytest.raises(Refused, match="no partner"):
        cloud.call_agent_wait("look", {"times": 2})


def test_it_has_the_limits_of_the_real_one() -> None:
    with FakeCoreAgent():
        for wrong in (
            lambda: communication.word_spotting([]),
            lambda: communication.word_spotting(["a"] * 101),
            lambda: communication.capture_audio(0),
            lambda: communication.capture_audio(301),
            lambda: communication.capture_audio_until_silence("../x.ogg"),
            lambda: communication.play_audio("nobody/recorded/this.ogg"),
            lambda: communication.play_audio(communication.capture_audio(1), volume=2.0),
            lambda: cloud.call_wait("x", {"x": float("nan")}),
        ):
            with pytest.raises(Invalid):
                wrong()
        with pytest.raises(Refused):
            cloud.send_mail_wait(["a@b.example"], "s", "b", "/etc/passwd")


def test_with_a_package_it_refuses_what_package_json_does_not_name(tmp_path: Path) -> None:
    rapp = {"permissions": {"core": ["rapp_say"], "cloud": ["profile"]}, "parameters": {"n": 1}}
    (tmp_path / "package.json").write_text(json.dumps({"name": "x", "rapp": rapp}))
    with FakeCoreAgent(services={"profile": 1, "other": 2}, package=tmp_path) as core:
        communication.rapp_say("hello")
        assert (core.parameters, cloud.call_wait("profile")) == ({"n": 1}, 1)
        for refused in (
            lambda: communication.rapp_record(1.0),
            lambda: cloud.call_wait("other"),
            lambda: cloud.send_mail_wait([], "", ""),
        ):
            with pytest.raises(Refused, match=r"package\.json"):
                refused()


def test_it_is_the_core_agent_only_within_its_block() -> None:
    with FakeCoreAgent():
        current()
    with pytest.raises(Bug):
        current()


def test_its_body_is_where_it_was_told_to_go() -> None:
    with FakeCoreAgent() as core:
        navigation.set_global_pose(Pose(1.0, 2.0, math.pi / 2))
        navigation.move_to(1.0, 0.0, 0.0)
        assert (navigation.get_robot_pose().x, navigation.get_robot_pose().y) == pytest.approx((1.0, 3.0))
        navigation.move_along_path([Pose(0.0, 3.0), Pose(0.5, 0.0, 0.0, "base_link")])
        assert core.pose.y == pytest.approx(3.5)
        navigation.move_vel(0.1, 0.0, 0.0)
        navigation.move_stop()
        navigation.move_joint("HeadYaw", 0.5)
        navigation.look_at_point(1.0, 0.0, 0.3)
        navigation.rest()
        assert (core.velocity, core.joints["HeadYaw"], core.posture) == ((0.0, 0.0, 0.0), 0.5, "Sit")
        assert navigation.get_transform("CameraTop", navigation.ROBOT).shape == (4, 4)


def test_its_body_has_the_limits_of_the_real_one() -> None:
    with FakeCoreAgent() as core:
        for wrong in (
            lambda: navigation.move_to(math.nan, 0.0, 0.0),
            lambda: navigation.move_vel(0.0, math.inf, 0.0),
            lambda: navigation.move_joint("Tail", 0.0),
            lambda: navigation.move_joint("HeadYaw", 3.0),
            lambda: navigation.move_joint(["HeadYaw"], [0.0, 0.1]),
            lambda: navigation.take_predefined_posture("Headstand"),
            lambda: navigation.rest("Stand"),
            lambda: navigation.move_along_path([]),
            lambda: navigation.move_along_path([Pose(0.0, 0.0, 0.0, "moon")]),
            lambda: navigation.get_transform("CameraTop", 3),
            lambda: vision.capture_image("left"),
            lambda: vision.capture_image("top", 4),
            lambda: vision.set_camera_param(2, 0, 1),
            lambda: vision.set_camera_params(0, [0], []),
            lambda: navigation.action_client("rapp_say"),
        ):
            with pytest.raises(Invalid, match="cannot"):
                wrong()
        for forbidden in (
            lambda: navigation.move_to(8.0, 8.0, 0.0),
            lambda: navigation.move_vel(0.2, 0.0, 0.0),
            lambda: navigation.look_at_point(-1.0, 0.0, 0.0),
        ):
            with pytest.raises(Refused, match="cannot"):
                forbidden()
        assert core.pose == Pose(0.0, 0.0, 0.0)


def test_walks_end_as_the_test_says() -> None:
    with FakeCoreAgent(walks=[Refused("cannot walk: there is an obstacle"), None]) as core:
        with pytest.raises(Refused, match="obstacle"):
            navigation.move_to(1.0, 0.0, 0.0)
        assert core.pose.x == 0.0
        navigation.move_to(1.0, 0.0, 0.0)
        assert core.pose.x == 1.0


def test_pictures_come_one_after_another_and_a_failed_one_is_empty(tmp_path: Path) -> None:
    picture = np.full((2, 3, 3), 7, np.uint8)
    with FakeCoreAgent(pictures=[picture]):
        assert np.array_equal(vision.capture_image(), picture)
        assert vision.capture_image("bottom", vision.QVGA).shape == (240, 320, 3)
    (tmp_path / "package.json").write_text(json.dumps({"name": "x", "rapp": {"permissions": {"core": [], "cloud": []}}}))
    with FakeCoreAgent(package=tmp_path):
        assert vision.capture_image().shape == (0, 0, 3)


def test_its_action_clients_carry_goals_out_at_once() -> None:
    with FakeCoreAgent(walks=[Refused("cannot walk: there is an obstacle")]) as core:
        for name, goal in (
            ("rapp_take_predefined_posture", TakePostureGoal(posture="Sit")),
            ("rapp_move_joint", MoveJointGoal(joints=["HeadYaw"], angles=[0.2])),
        ):
            client = navigation.action_client(name)
            client.send_goal(goal)
            assert (client.wait_for_result(), client.get_state(), client.get_result().success) == (True, 3, True)
        assert (core.posture, core.joints["HeadYaw"]) == ("Sit", 0.2)
        client = navigation.action_client("rapp_move_to")
        client.send_goal(MoveToGoal(x=1.0))
        assert (client.get_state(), client.get_result().error) == (4, "refused")


def test_what_is_kept_can_be_looked_at() -> None:
    with FakeCoreAgent() as core:
        assert keepsakes.keep("table.jpg", b"picture") == "/keepsakes/table.jpg"
        assert core.kept == {"table.jpg": b"picture"}
        with pytest.raises(Invalid, match="name a file"):
            keepsakes.keep("../table.jpg", b"picture")
        with pytest.raises(Refused, match="smaller"):
            keepsakes.keep("big", bytes((8 << 20) + 1))
