"""A core agent's place in ROS, behind gates: services, an action and things that are no RApp's business; notes each caller.

python gated_core.py NOTES
"""

import json
import signal
import sys
import threading
from pathlib import Path
from typing import Any

import rapp_msgs.msg
import rapp_msgs.srv
import rospy
from actionlib import SimpleActionServer
from std_msgs.msg import String

NOTES = Path(sys.argv[1])
lock = threading.Lock()


def note(name: str, header: dict[str, str], **fields: Any) -> None:
    with lock, NOTES.open("a") as notes:
        line = {"name": name, "caller": header["callerid"], "secret": header.get("rapp_channel", ""), **fields}
        notes.write(json.dumps(line) + "\n")


def serve(name: str, srv: str) -> rospy.Service:
    cls = getattr(rapp_msgs.srv, srv)

    def handle(request: Any) -> Any:
        size = len(request.data) if srv == "Keep" else 0
        note(name, request._connection_header, size=size)
        return cls._response_class(success=True)

    return rospy.Service(name, cls, handle)


def walk(goal: Any) -> None:
    answers = (server.action_server.feedback_pub, server.action_server.result_pub)
    while not all(each.get_num_connections() for each in answers) and not stop.wait(0.02):
        pass  # roslib's client sends its goal before it can hear the answers
    server.publish_feedback(rapp_msgs.msg.MoveToFeedback())
    server.set_succeeded(rapp_msgs.msg.MoveToResult(success=True))


stop = threading.Event()
for number in (signal.SIGTERM, signal.SIGINT):
    signal.signal(number, lambda *_: stop.set())
rospy.init_node("core_agent", disable_signals=True, disable_rosout=True)
for each in ("rapp_say", "rapp_hop/secret"):
    serve(each, "Say")
serve("rapp_keep", "Keep")
serve("rapp_rest", "Rest")
server = SimpleActionServer("rapp_move_to", rapp_msgs.msg.MoveToAction, walk, auto_start=False)
rospy.Subscriber("rapp_move_to/goal", rapp_msgs.msg.MoveToActionGoal, lambda m: note("goal", m._connection_header))
state = rospy.Publisher("~state", String, queue_size=1, latch=True)
state.publish("of the robot")
server.start()
print("READY {}", flush=True)
stop.wait()
rospy.signal_shutdown("the test has ended")
