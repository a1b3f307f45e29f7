"""The ROS side of `rosbridge.py`: a rospy node that does what lines of JSON on stdin tell it, and answers on stdout.

Each line {"do": ..., ...} is served in a thread of its own and answered by one line with the same "do".
"""

import json
import sys
import threading
import time
from typing import Any

import rospy
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolResponse

RANGES = 720  # of a scan; as many intensities
LARGE = 100_000  # bytes


def picture(width: int, height: int) -> Image:
    """Stripes with some noise."""
    row = bytes((x * 255 // (width * 3)) & 255 for x in range(width * 3))
    rows = [bytes((value + y * 7919 % 31) & 255 for value in row) if y % 4 == 0 else row for y in range(height)]
    return Image(width=width, height=height, encoding="rgb8", step=width * 3, data=b"".join(rows))


MESSAGES: dict[str, Any] = {
    "small": lambda: String("x" * 32),
    "scan": lambda: LaserScan(ranges=[1 + i / RANGES for i in range(RANGES)], intensities=[i / 3 for i in range(RANGES)]),
    "vga": lambda: picture(640, 480),
    "hd": lambda: picture(1280, 960),
    "large": lambda: String("x" * LARGE),
}


class Node:
    """What the node is told to do; `heard` counts the messages of each topic it listens to."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._publishers: dict[str, rospy.Publisher] = {}
        self._heard: dict[str, list[float]] = {}
        self._late: dict[str, list[float]] = {}  # s

    def serve(self, words: dict[str, Any]) -> None:
        """Do it, and answer."""
        answer = getattr(self, words["do"])(words)
        with self._lock:
            print(json.dumps({"do": words["do"], **answer}), flush=True)

    def show(self, words: dict[str, Any]) -> dict[str, Any]:
        """Advertise a topic."""
        message = MESSAGES[words["kind"]]()
        latch = words.get("latch", False)
        publisher = rospy.Publisher(words["topic"], type(message), queue_size=None, latch=latch)
        self._publishers[words["topic"]] = publisher
        if latch:
            publisher.publish(message)
        return {}

    def flood(self, words: dict[str, Any]) -> dict[str, Any]:
        """Publish so many messages as fast as they are taken, once somebody listens."""
        message, publisher = MESSAGES[words["kind"]](), self._publishers[words["topic"]]
        while not publisher.get_num_connections():
            time.sleep(0.01)
        began = time.monotonic()
        for _ in range(words["count"]):
            publisher.publish(message)
        return {"began": began}

    def tick(self, words: dict[str, Any]) -> dict[str, Any]:
        """Publish strings that begin with the time, so many in a second; `size`: their bytes."""
        publisher = self._publishers[words["topic"]]
        while not publisher.get_num_connections():
            time.sleep(0.01)
        due, count = time.monotonic(), 0
        end = due + words["seconds"]
        while due < end:
            publisher.publish(String(f"T{time.monotonic():.6f};" + "x" * words["size"]))
            count += 1
            due += 1 / words["hz"]
            time.sleep(max(0.0, due - time.monotonic()))
        return {"count": count}

    def listen(self, words: dict[str, Any]) -> dict[str, Any]:
        """Count the messages of a topic, and how late they come when they begin with the time."""
        times = self._heard[words["topic"]] = [0, 0.0, 0.0]
        late = self._late[words["topic"]] = []

        def hear(message: Any) -> None:
            times[2] = time.monotonic()
            times[1] = times[1] or times[2]
            times[0] += 1
            if message.data.startswith("T"):
                late.append(times[2] - float(message.data[1 : message.data.index(";")]))

        rospy.Subscriber(words["topic"], String, hear, queue_size=None, tcp_nodelay=True)
        return {}

    def heard(self, words: dict[str, Any]) -> dict[str, Any]:
        """Wait until so many messages were heard, or no more come; when the first and the last came."""
        times, before = self._heard[words["topic"]], -1.0
        while before < times[0] < words["count"]:
            before = times[0]
            time.sleep(1.0)
        count, first, last = times
        times[:] = [0, 0.0, 0.0]
        return {"count": count, "first": first, "last": last, "late": self._late[words["topic"]]}

    def call(self, words: dict[str, Any]) -> dict[str, Any]:
        """Call a service one time after another, for so many seconds."""
        rospy.wait_for_service(words["service"], 10)
        proxy = rospy.ServiceProxy(words["service"], SetBool, persistent=words["persistent"])
        took, error, end = [], "", time.monotonic() + words["seconds"]
        while not error and (began := time.monotonic()) < end and len(took) < words.get("most", 1 << 30):
            try:
                proxy(True)
            except rospy.ServiceException as problem:
                error = str(problem)
            took.append(time.monotonic() - began)
        return {"took": took, "error": error}


def main() -> None:
    rospy.init_node("bench_node", anonymous=True, disable_signals=True, disable_rosout=True)
    node = Node()
    if "--serve" in sys.argv:
        rospy.Service("/bench/call", SetBool, lambda request: SetBoolResponse(request.data, "ok"))
    print("READY", flush=True)
    for line in sys.stdin:
        threading.Thread(target=node.serve, args=(json.loads(line),), daemon=True).start()


main()
