"""Moving and seeing through ROS on the simulated robot: services, actions, stop, reflexes, and the end of who moves it."""

import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from fakes.rapps import install_rapp
from rapp_core.robot.naoqi.connection import Connection

TOKEN = "secret of this test"
PATIENCE = 30.0  # s
STILL = 0.01  # m within `LOOK`, of a robot that does not walk
LOOK = 0.4  # s
CLIENT = f"""
import json, os, sys, threading, time
import actionlib, rospy
from rapp_msgs.msg import MoveToAction, MoveToGoal, TakePostureGoal
from rapp_api import Pose, RappError, core_agent, navigation, vision
from rapp_api.ros_core_agent import RosCoreAgent
rospy.init_node("client", anonymous=True, disable_rosout=True, disable_signals=True)
core_agent.use(RosCoreAgent({TOKEN!r}))
def outcome(call, *args):
    try:
        return call(*args)
    except RappError as error:
        return [type(error).__name__, str(error)]
def tell(value):
    os.write(1, (json.dumps(value) + "\\n").encode())  # whole, whichever thread tells
"""


class Half:
    """A simulated robot, the half of the core agent that serves its body, and RApps' halves that call it."""

    def __init__(self, url: str, process: subprocess.Popen[str], env: dict[str, str]) -> None:
        self.connection = Connection(url, 5.0)
        self.world = self.connection.service("SimWorld")
        self.motion = self.connection.service("ALMotion")
        self.process = process
        self.env = env

    def client(self, body: str) -> "Client":
        """A program that calls the core agent, begun."""
        return Client([sys.executable, "-c", CLIENT + body], self.env)

    def still(self) -> bool:
        """Whether the robot stands still."""
        before = self.world.getRobotPose()
        time.sleep(LOOK)
        after = self.world.getRobotPose()
        return math.dist(before[:2], after[:2]) < STILL

    def until_walking(self) -> None:
        start = self.world.getRobotPose()
        self.until(lambda: math.dist(start[:2], self.world.getRobotPose()[:2]) > 0.03)

    def until(self, condition: Callable[[], Any]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, "it did not happen"
            time.sleep(0.05)

    def memory(self) -> int:
        """Bytes that the half of the core agent has in memory."""
        pages = Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]
        return int(pages) * os.sysconf("SC_PAGE_SIZE")

    def end_lease(self) -> bool:
        """Gives whether the robot was moved under it."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write("end\n")
        self.process.stdin.flush()
        return self.process.stdout.readline() == "True\n"


class Client:
    """A calling program; its lines of JSON."""

    def __init__(self, words: list[str], env: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            words, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def say(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()

    def rest(self) -> list[Any]:
        """All further lines; it has ended then."""
        out, errors = self._process.communicate(timeout=PATIENCE)
        assert self._process.returncode == 0, errors[-3000:]
        return [json.loads(line) for line in out.splitlines()]


@pytest.fixture(scope="module")
def half(start_for_module, ros_env, tmp_path_factory) -> Iterator[Half]:
    folder = tmp_path_factory.mktemp("half")
    sim = start_for_module("rapp_nao_sim", "--microphone", "text", "--voice", "silent", "--port", "0", "--files", str(folder))
    url = f"tcp://127.0.0.1:{sim.ready['port']}"
    env = {**ros_env, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), ros_env.get("PYTHONPATH", "")])}
    words = [sys.executable, str(Path(__file__).with_name("body_half.py")), url, TOKEN, str(folder)]
    with (folder / "half.log").open("wb") as log:
        process = subprocess.Popen(words, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True)
    assert process.stdout is not None
    assert process.stdin is not None
    assert process.stdout.readline().startswith("READY"), (folder / "half.log").read_text()
    half = Half(url, process, ros_env)
    yield half
    process.stdin.close()
    process.wait(10)
    process.stdout.close()
    half.connection.close()


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


WALK = """
def walk():
    tell(outcome(navigation.move_to, 1.5, 0.0, 0.0))
thread = threading.Thread(target=walk)
thread.start()
"""


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


def test_a_walk_with_a_velocity_starts_from_stand_init_and_does_not_block(half):
    posture, start = half.connection.service("ALRobotPosture"), half.world.getRobotPose()
    assert posture.goToPosture("Sit", 1.0)
    half.client("navigation.move_vel(0.05, 0.0, 0.0); tell('back')").rest()
    half.until(lambda: posture.getPosture() == "StandInit")
    assert math.dist(start[:2], half.world.getRobotPose()[:2]) < 0.03
    half.until_walking()
    half.client("navigation.move_stop()").rest()
    half.until(half.still)


def test_the_end_of_the_lease_ends_a_walk(half):
    client = half.client(WALK)
    half.until_walking()
    assert half.end_lease()
    ((kind, words),) = client.rest()
    assert kind == "Refused"
    assert "lease has ended" in words
    half.until(half.still)


def test_an_action_tells_how_far_it_is_and_can_be_cancelled(half):
    answers = half.client("""
client = navigation.action_client("rapp_move_to")
tell(client.wait_for_server(rospy.Duration(10)))
ways = []
def feel(feedback):
    ways.append(feedback.x)
    if feedback.x > 0.05:
        client.cancel_goal()
client.send_goal(MoveToGoal(x=1.5), feedback_cb=feel)
tell(client.wait_for_result(rospy.Duration(30)))
result = client.get_result()
tell([client.get_state(), result.success, result.error, client.get_goal_status_text(), ways == sorted(ways), max(ways)])
tell(client.send_goal_and_wait(MoveToGoal(theta=0.3)))
tell(client.get_result().success)
""").rest()
    state, success, error, text, growing, farthest = answers[2]
    assert answers[:2] == [True, True]
    assert (state, success, error, text) == (2, False, "refused", "cannot finish: cancelled")  # PREEMPTED
    assert farthest < 0.4, growing
    assert answers[3:] == [3, True]  # SUCCEEDED
    half.until(half.still)


def test_r05_a_newer_goal_ends_an_older_one_on_the_same_limbs(half):
    answers = half.client("""
walk, posture = navigation.action_client("rapp_move_to"), navigation.action_client("rapp_take_predefined_posture")
for client in (walk, posture):
    tell(client.wait_for_server(rospy.Duration(10)))
walking = threading.Event()
walk.send_goal(MoveToGoal(x=1.5), feedback_cb=lambda feedback: feedback.x > 0.03 and walking.set())
tell(walking.wait(20))
posture.send_goal(TakePostureGoal(posture="StandInit"))
tell(walk.wait_for_result(rospy.Duration(5)))
tell([walk.get_state(), walk.get_goal_status_text()])
tell(posture.wait_for_result(rospy.Duration(20)))
tell([posture.get_state(), posture.get_result().message])
""").rest()
    assert answers[:4] == [True] * 4
    assert answers[4] == [2, "cannot finish: another call has taken over"]
    assert answers[5:] == [True, [3, ""]]


def test_a_goal_and_a_cancel_of_a_stranger_are_not_heeded(half):
    client = half.client(WALK)
    half.until_walking()
    stranger = subprocess.run([sys.executable, "-c", STRANGER], env=half.env, capture_output=True, text=True, timeout=PATIENCE)
    state, text, error = json.loads(stranger.stdout)
    assert state == 5  # REJECTED
    assert "only the dynamic agent that holds" in text
    assert error == "refused"
    assert not half.still()
    half.end_lease()
    client.rest()


STRANGER = """
import json, actionlib, rospy
from rapp_msgs.msg import MoveToAction, MoveToGoal
rospy.init_node("stranger", anonymous=True, disable_rosout=True, disable_signals=True)
client = actionlib.SimpleActionClient("rapp_move_to", MoveToAction)
client.wait_for_server(rospy.Duration(10))
client.send_goal(MoveToGoal(x=0.1))
client.wait_for_result(rospy.Duration(10))
client.cancel_all_goals()
rospy.sleep(0.3)
print(json.dumps([client.get_state(), client.get_goal_status_text(), client.get_result().error]))
"""


def test_a_plain_actionlib_client_whose_publishers_carry_the_header_is_served(half):
    done = subprocess.run([sys.executable, "-c", PLAIN], env=half.env, capture_output=True, text=True, timeout=PATIENCE)
    assert json.loads(done.stdout) == [3, True], done.stderr  # SUCCEEDED


PLAIN = f"""
import json, actionlib, rospy
from actionlib_msgs.msg import GoalID
from rapp_msgs.msg import MoveJointAction, MoveJointActionGoal, MoveJointGoal
rospy.init_node("plain", anonymous=True, disable_rosout=True, disable_signals=True)
header = {{"rapp_channel": {TOKEN!r}}}
goal = rospy.Publisher("rapp_move_joint/goal", MoveJointActionGoal, headers=header, queue_size=1)
cancel = rospy.Publisher("rapp_move_joint/cancel", GoalID, headers=header, queue_size=1)
client = actionlib.SimpleActionClient("rapp_move_joint", MoveJointAction)
client.wait_for_server(rospy.Duration(10))
state = client.send_goal_and_wait(MoveJointGoal(joints=["HeadYaw"], angles=[0.2]), rospy.Duration(10))
print(json.dumps([state, client.get_result().success]))
"""

FLOOD = """
import json, time, rospy
from rapp_msgs.msg import MoveToActionGoal
rospy.init_node("flood", anonymous=True, disable_rosout=True, disable_signals=True)
publishers = [rospy.Publisher(f"{name}/goal", MoveToActionGoal, queue_size=100_000) for name in ("rapp_move_to",)]
while not all(publisher.get_num_connections() for publisher in publishers):
    time.sleep(0.05)
goal, sent = MoveToActionGoal(), 0
print("FLOODING", flush=True)
until = time.monotonic() + 4.0
while time.monotonic() < until:
    sent += 1
    goal.goal_id.id = str(sent)
    for publisher in publishers:
        publisher.publish(goal)
print(sent)
"""


def test_r11_a_flood_of_messages_does_not_keep_the_holder_of_the_lease_from_being_served(half):
    with subprocess.Popen([sys.executable, "-c", FLOOD], env=half.env, stdout=subprocess.PIPE, text=True) as flood:
        assert flood.stdout.readline() == "FLOODING\n"
        answers = half.client("""
for _ in range(20):
    navigation.get_transform("Head", 0)
client = navigation.action_client("rapp_move_joint")
from rapp_msgs.msg import MoveJointGoal
tell(client.wait_for_server(rospy.Duration(20)))
tell(client.send_goal_and_wait(MoveJointGoal(joints=["HeadYaw"], angles=[0.1]), rospy.Duration(20)))
""").rest()
        during = flood.poll() is None
        sent = int(flood.stdout.readline())
    assert answers == [True, 3]
    assert during
    assert sent > 5_000
    assert half.memory() < 300e6
    half.client("navigation.move_to(0.05, 0.0, 0.0)").rest()


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
