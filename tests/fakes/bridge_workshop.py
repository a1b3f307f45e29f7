"""A rospy node that client libraries are tried with: topics of several types, an echo, and an action server."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

WORKSHOP = """
import actionlib, rospy
from actionlib.msg import TestAction, TestFeedback, TestResult
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import String

rospy.init_node("workshop", disable_signals=True)

def show(name, message):
    publisher = rospy.Publisher(name, type(message), latch=True, queue_size=1)
    publisher.publish(message)
    return publisher

image = Image(height=4, width=8, step=24, encoding="rgb8", data=bytes(range(96)))
scan = LaserScan(ranges=[0.5, 1.5, float("inf")])
scan.header.frame_id = "laser"
shown = [show("~text", String("kept")), show("~image", image), show("~scan", scan), show("~long", String("0123456789" * 200))]
rospy.set_param("~size", 96)
echo = rospy.Publisher("~out", String, queue_size=100)
rospy.Subscriber("~in", String, echo.publish)

def count(goal):
    topics = (counter.action_server.feedback_pub, counter.action_server.result_pub)
    while not all(topic.get_num_connections() for topic in topics):  # actionlib does not wait for who is still connecting
        rospy.sleep(0.01)
    number = 0
    while number < goal.goal and not counter.is_preempt_requested():
        number += 1
        counter.publish_feedback(TestFeedback(number))
        rospy.sleep(0.01)
    end = counter.set_succeeded if number == goal.goal else counter.set_preempted
    end(TestResult(number))

counter = actionlib.SimpleActionServer("~count", TestAction, count, auto_start=False)
counter.start()
print("READY", flush=True)
rospy.spin()
"""


@contextmanager
def workshop(ros_env: dict[str, str]) -> Iterator[None]:
    """The running node, /workshop."""
    process = subprocess.Popen([sys.executable, "-c", WORKSHOP], env=ros_env, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "READY\n"
        yield
    finally:
        process.kill()
        process.communicate()
