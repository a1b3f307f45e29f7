"""Moving by actions (actionlib) on the simulated robot: feedback, cancelling, newer goals, strangers, floods."""

import json
import subprocess
import sys
from collections.abc import Iterator

import pytest

from fakes.body_half import PATIENCE, TOKEN, WALK, Half, running_half


@pytest.fixture(scope="module")
def half(start_for_module, ros_env, tmp_path_factory) -> Iterator[Half]:
    with running_half(start_for_module, ros_env, tmp_path_factory.mktemp("half")) as half:
        yield half


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


def test_a_goal_of_no_use_ends_nothing(half):
    answers = half.client("""
walk, other = (navigation.action_client("rapp_move_to") for _ in range(2))
for client in (walk, other):
    tell(client.wait_for_server(rospy.Duration(10)))
walking = threading.Event()
walk.send_goal(MoveToGoal(x=0.2), feedback_cb=lambda feedback: feedback.x > 0.03 and walking.set())
tell(walking.wait(20))
other.send_goal(MoveToGoal(x=float("nan")))
tell(other.wait_for_result(rospy.Duration(5)))
tell([other.get_state(), other.get_result().error])
tell(walk.wait_for_result(rospy.Duration(30)))
tell([walk.get_state(), walk.get_result().message])
""").rest()
    assert answers == [True, True, True, True, [4, "invalid"], True, [3, ""]]


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
