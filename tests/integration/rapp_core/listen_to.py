"""Prints what comes on topics as JSON lines [topic, what is told of the message]; ends when each topic has spoken."""

import json
import sys
import threading
from typing import Any

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, Range
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

TYPES: dict[str, tuple[Any, Any]] = {
    "joint_states": (JointState, lambda m: sorted(m.name)),
    "odom": (Odometry, lambda m: [m.header.frame_id, m.child_frame_id, m.pose.pose.orientation.w]),
    "sonar/left": (Range, lambda m: [m.header.frame_id, m.range]),
    "sonar/right": (Range, lambda m: [m.header.frame_id, m.range]),
    "bumper/left": (Bool, lambda m: m.data),
    "bumper/right": (Bool, lambda m: m.data),
    "/tf": (TFMessage, lambda m: [[t.header.frame_id, t.child_frame_id] for t in m.transforms]),
    "camera/top/image_raw": (Image, lambda m: [m.width, m.height, m.encoding, len(m.data), sum(m.data[::997])]),
    "camera/bottom/image_raw": (Image, lambda m: [m.width, m.height, m.encoding, len(m.data), sum(m.data[::997])]),
    "camera/top/image_raw/compressed": (CompressedImage, lambda m: [m.format, m.data[:2].hex()]),
    "camera/top/camera_info": (CameraInfo, lambda m: [m.width, m.height, m.K[0]]),
    "/diagnostics": (DiagnosticArray, lambda m: {s.name: [s.level, s.message] for s in m.status}),
}

rospy.init_node("listener", anonymous=True, disable_rosout=True)
waiting = set(sys.argv[1:] or TYPES)
done = threading.Event()
lock = threading.Lock()


def tell(message: Any, topic: str) -> None:
    with lock:
        if topic in waiting:
            waiting.discard(topic)
            print(json.dumps([topic, TYPES[topic][1](message)]), flush=True)
        if not waiting:
            done.set()


for name in list(waiting):
    rospy.Subscriber(name, TYPES[name][0], tell, callback_args=name, queue_size=5)
sys.exit(0 if done.wait(30) else f"nothing came on {sorted(waiting)}")
