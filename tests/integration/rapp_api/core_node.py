"""A ROS node that serves some of the core agent's services, for one secret; it notes each call as a line of JSON.

python core_node.py NOTES SECRET
"""

import json
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Any

import rapp_msgs.srv
import rospy

NOTES, SECRET = Path(sys.argv[1]), sys.argv[2]
lock = threading.Lock()
connections: set[str] = set()


def serve(name: str, srv: str, answer: Any) -> Any:
    cls = getattr(rapp_msgs.srv, srv)

    def handle(request: Any) -> Any:
        response = cls._response_class()
        header = request._connection_header
        with lock, NOTES.open("a") as notes:
            fields = {field: getattr(request, field) for field in request.__slots__}
            notes.write(json.dumps({"service": name, "caller": header["callerid"], **fields}) + "\n")
        if header.get("rapp_channel") != SECRET:
            response.message = "cannot serve this call: not the holder of the lease"
        else:
            response.success = True
            answer(request, response)
        return response

    return rospy.Service(name, cls, handle)


def say(request: Any, response: Any) -> None:
    if request.text == "refuse":
        response.success, response.message = False, "cannot say that: it is forbidden"
    elif request.text.startswith("wait "):
        time.sleep(float(request.text[5:]))


quick_ones = threading.Semaphore(0)


def cloud_call(request: Any, response: Any) -> None:
    if request.service == "away":
        response.success, response.error, response.message = False, "unreachable", "cannot reach the platform: try later"
    elif request.service == "quick":
        quick_ones.release()
    elif request.service == "slow" and not quick_ones.acquire(timeout=10):
        response.success, response.error, response.message = False, "bug", "cannot answer before a quick call came"
    response.result = json.dumps({"echo": json.loads(request.arguments), "timeout": request.timeout})


def recognize(request: Any, response: Any) -> None:
    response.word = request.dictionary[-1]


def record(request: Any, response: Any) -> None:
    response.path = "/recordings/1.ogg"


def send_mail(request: Any, response: Any) -> None:
    response.state = "kept"


stop = threading.Event()
for number in (signal.SIGTERM, signal.SIGINT):
    signal.signal(number, lambda *_: stop.set())
rospy.init_node("core_agent", disable_signals=True, disable_rosout=True)
serve("rapp_say", "Say", say)
serve("rapp_recognize", "Recognize", recognize)
serve("rapp_record", "Record", record)
serve("rapp_cloud_call", "CloudCall", cloud_call)
serve("rapp_send_mail", "SendMail", send_mail)
print("READY {}", flush=True)
stop.wait()
rospy.signal_shutdown("the test has ended")
