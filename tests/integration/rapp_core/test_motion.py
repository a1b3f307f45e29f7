"""Moving and seeing through ROS on the simulated robot: services, stop, reflexes, and the end of who moves it."""

import math
import time
from collections.abc import Iterator

import pytest

from fakes.body_half import WALK, Half, running_half
from fakes.rapps import install_rapp


@pytest.fixture(scope="module")
def half(start_for_module, ros_env, tmp_path_factory) -> Iterator[Half]:
    with running_half(start_for_module, ros_env, tmp_path_factory.mktemp("half")) as half:
        yield half


def test_tells_places_sees_and_names_what_is_wrong(half):
    answers = half.client("""
navigation.set_global_pose(Pose(5.0, 6.0, 1.0))
pose = navigation.get_robot_pose()
tell([pose.x, pose.y, pose.theta, pose.frame])
tell(navigation.get_transform("CameraTop", navigation.TORSO).tolist())
tell([vision.capture_image(camera, resolution).shape for camera in ("top", "bottom") for resolution in (0, 2)])
tell(vision.set_camera_params(0, [0, 99], [60, 1]))
for call, args in [
    (navigation.move_joint, ("Tail", 0.1)), (navigation.take_predefined_posture, ("Headstand",)), (navigation.move_vel, (9, 0, 0)),
    (navigation.move_to, (float("nan"), 0, 0)), (navigation.move_along_path, ([Pose(0, 0, 0, "moon")],)),
    (vision.capture_image, ("left",)), (navigation.get_transform, ("Tail", 0)), (vision.set_camera_param, (0, 0, 999)),
]:
    tell(outcome(call, *args))
""").rest()
    assert answers[0] == [pytest.approx(5.0, abs=1e-3), pytest.approx(6.0, abs=1e-3), pytest.approx(1.0, abs=1e-3), "map"]
    assert answers[1][3] == [0.0, 0.0, 0.0, 1.0]
    assert answers[2] == [[120, 160, 3], [480, 640, 3]] * 2
    assert answers[3] == [True, False]
    kinds, words = zip(*answers[4:], strict=True)
    assert kinds == ("Invalid", "Invalid", "Refused", "Invalid", "Invalid", "Invalid", "Invalid", "Refused")
    for text, known in zip(words, ("HeadYaw", "Crouch", "0.1", "numbers", "base_link", "bottom", "LArm", "255"), strict=True):
        assert known in text


def test_a_second_caller_stops_a_walk_at_once(half):
    client = half.client(f"""{WALK}
sys.stdin.readline()
begun = time.monotonic()
navigation.move_stop()
tell(time.monotonic() - begun)
thread.join()
tell(time.monotonic() - begun)
""")
    half.until_walking()
    client.say("stop")
    answers = client.rest()
    assert ["Refused", "cannot finish: stopped"] in answers
    stopping, told = (answer for answer in answers if isinstance(answer, float))
    assert stopping < 0.5
    assert told < 0.5
    half.until(half.still)


def test_a_bumper_stops_a_walk_and_is_named(half):
    client = half.client(WALK)
    half.until_walking()
    half.world.touch("LeftBumper", 0.5)
    ((kind, words),) = client.rest()
    assert (kind, words) == ("Refused", "cannot walk: the bumper of the left foot is pressed; step back")
    half.until(half.still)


def test_an_obstacle_ahead_stops_a_walk_and_is_named(half):
    x, y, theta = half.world.getRobotPose()
    half.world.placeObject("carton", x + 0.8 * math.cos(theta), y + 0.8 * math.sin(theta), 0.2, theta)
    try:
        ((kind, words),) = half.client(WALK).rest()
        assert kind == "Refused"
        assert "obstacle 0.2" in words
        half.until(half.still)
        assert math.dist((x, y), half.world.getRobotPose()[:2]) < 0.65
    finally:
        half.world.removeObject("carton")


def test_what_stops_a_walk_with_a_velocity_is_told_with_the_next_reply(half):
    client = half.client("""
tell(navigation.move_vel(0.08, 0.0, 0.0))
sys.stdin.readline()
tell(navigation.move_stop())
tell(navigation.move_stop())
""")
    half.until_walking()
    half.world.touch("LeftBumper", 0.5)
    half.until(half.still)
    client.say("stop")
    assert client.rest() == ["", "cannot walk: the bumper of the left foot is pressed; step back", ""]


def test_a_walk_with_a_velocity_starts_from_stand_init_and_does_not_block(half):
    posture, start = half.connection.service("ALRobotPosture"), half.world.getRobotPose()
    assert posture.goToPosture("Sit", 1.0)
    half.client("navigation.move_vel(0.05, 0.0, 0.0); tell('back')").rest()
    half.until(lambda: posture.getPosture() == "StandInit")
    assert math.dist(start[:2], half.world.getRobotPose()[:2]) < 0.03
    half.until_walking()
    half.client("navigation.move_stop()").rest()
    half.until(half.still)


def test_joints_that_somebody_else_has_stopped_have_not_arrived(half):
    client = half.client("tell(outcome(navigation.move_joint, 'HeadYaw', 1.5, 0.02))")
    half.until(lambda: half.motion.getAngles("HeadYaw", False)[0] > 0.1)
    half.motion.killAll()
    ((kind, words),) = client.rest()
    assert kind == "Refused"
    assert "ended angleInterpolationWithSpeed by itself" in words


def test_the_end_of_the_lease_ends_a_walk(half):
    client = half.client(WALK)
    half.until_walking()
    assert half.end_lease()
    ((kind, words),) = client.rest()
    assert kind == "Refused"
    assert "lease has ended" in words
    half.until(half.still)


def test_r10_a_fall_ends_a_walk_and_is_named_and_a_low_battery_does_not(half):
    half.world.setBattery(0.05)
    client = half.client(WALK)
    half.until_walking()
    half.world.pushRobot(0.0, 60.0, 0.3)
    ((kind, words),) = client.rest()
    half.world.setBattery(1.0)
    assert (kind, words) == ("Refused", "cannot walk: the robot has fallen; help it up")
    assert half.world.hasFallen()
    assert half.client("tell(outcome(navigation.move_to, 0.1, 0.0, 0.0))").rest() == [[kind, words]]
    half.client("navigation.take_predefined_posture('StandInit')").rest()
    assert not half.world.hasFallen()


WALKS_AND_IS_KILLED = """
import os, signal, time
from rapp_api import navigation
navigation.move_vel(0.08, 0.0, 0.0)
start = navigation.get_robot_pose()
while abs(navigation.get_robot_pose().x - start.x) + abs(navigation.get_robot_pose().y - start.y) < 0.06:
    self.pause(0.05)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_rapp_that_is_killed_while_it_walks_leaves_a_still_robot_at_rest(start, tmp_path):
    home = tmp_path / "home"
    sim = start("rapp_nao_sim", "--microphone", "text", "--voice", "silent", "--port", "0", "--files", str(home))
    url = f"tcp://127.0.0.1:{sim.ready['port']}"
    permissions = {"core": ["rapp_move_vel", "rapp_get_robot_pose"], "cloud": []}
    install_rapp(home, "walker", WALKS_AND_IS_KILLED, permissions=permissions)
    start("rapp_core", "--robot", url, "--home", str(home))
    half = Half(url, sim.process, {})
    try:
        said: list[str] = []
        half.world.robotSaid.connect(said.append)
        half.until(lambda: "I am ready, but I cannot reach the platform" in said)
        begun = half.world.getRobotPose()

        def walks() -> bool:
            half.world.micText("walker")
            time.sleep(0.5)
            return math.dist(begun[:2], half.world.getRobotPose()[:2]) > 0.04

        half.until(walks)
        half.until(lambda: "It has crashed" in said)
        assert half.still()
        half.until(lambda: not half.motion.robotIsWakeUp())
    finally:
        half.connection.close()
