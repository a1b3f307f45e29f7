"""How well the robot sees: what it looks at, what it reads, how many pictures come through ROS."""

import math
import threading
import time

import cv2
import numpy as np
import rospy
from numpy.typing import NDArray
from sensor_msgs.msg import Image
from stage import Result, Stage, matrix, settle

from rapp_api import navigation, vision

POINTS = ((1.0, 0.0, 0.4), (1.0, 0.6, 0.55), (0.9, -0.7, 0.3), (1.2, 0.3, 0.75), (0.9, -0.2, 0.15), (0.3, 0.9, 0.5))
BESIDE = 10.0  # pixels, aim
WATCHED = 5.0  # s that pictures are counted
AIM_RATE = 10.0  # pictures/s
CODE = (1.56, 0.0, 0.45)
READ = '{"name": "door"}'
BGR = 13

Picture = NDArray[np.uint8]


def looks(stage: Stage) -> list[Result]:
    """A red knob is put where the robot is to look, and found in its picture."""
    navigation.take_predefined_posture("StandInit")  # the arms down: their orange parts are not to be seen
    beside = []
    for point in POINTS:
        x, y, z, _ = (matrix(stage.pose()) @ [*point, 1.0]).tolist()
        stage.robot.room("placeObject", "knob", x, y, z, 0.0)
        navigation.look_at_point(*point)
        settle()
        beside.append(from_middle(vision.capture_image("top", vision.VGA)))
    stage.robot.room("removeObject", "knob")
    words = f"{max(beside):.1f} pixels"
    return [
        Result(
            f"lookAtPoint: from the VGA picture's middle, worst of {len(POINTS)}",
            words,
            f"≤ {BESIDE:.0f} pixels",
            kept=max(beside) <= BESIDE,
        )
    ]


def from_middle(picture: Picture) -> float:
    """Pixels between the red in a picture and its middle; infinite when nothing is red."""
    blue, green, red = (picture[..., layer].astype(int) for layer in range(3))
    rows, columns = np.nonzero((red > 60) & (red > 3 * np.maximum(blue, green)))
    if not len(rows):
        return math.inf
    middle = (picture.shape[1] - 1) / 2, (picture.shape[0] - 1) / 2
    return math.dist(middle, ((columns.min() + columns.max()) / 2, (rows.min() + rows.max()) / 2))


def codes(stage: Stage, times: int = 5) -> list[Result]:
    """The code on the wall, from the robot's own picture."""
    x, y, z, _ = (np.linalg.inv(matrix(stage.pose())) @ [*CODE, 1.0]).tolist()
    navigation.look_at_point(x, y, z)
    settle()
    away = float(np.linalg.norm(stage.link("Head")[:3, 3] - CODE))
    pictures = [vision.capture_image("top", vision.QUAD_VGA) for _ in range(times)]
    read = sum(cv2.QRCodeDetector().detectAndDecode(picture)[0] == READ for picture in pictures)
    what = f"QR code of 26 cm read in 4VGA pictures, {away:.2f} m from the neck"
    return [Result(what, f"{read} of {times}", f"{times} of {times}", kept=read == times)]


def pictures(stage: Stage) -> list[Result]:
    """VGA pictures that reach a subscriber, and those that NAOqi itself gives."""
    through, bare = through_ros(), past_ros(stage)
    words = f"{through:.1f} pictures/s"
    return [
        Result(
            "VGA pictures through ROS", words, f"≥ {AIM_RATE:.0f} pictures/s", f"NAOqi alone {bare:.1f}", kept=through >= AIM_RATE
        )
    ]


def through_ros() -> float:
    """Pictures per second of the top camera's topic."""
    came: list[float] = []
    first = threading.Event()

    def take(_message: Image) -> None:
        came.append(time.monotonic())
        first.set()

    subscriber = rospy.Subscriber("camera/top/image_raw", Image, take, queue_size=5, buff_size=1 << 24, tcp_nodelay=True)
    if not first.wait(20):
        raise SystemExit("cannot measure: no picture comes on camera/top/image_raw")
    time.sleep(WATCHED)
    subscriber.unregister()
    return (len(came) - 1) / (came[-1] - came[0])


def past_ros(stage: Stage) -> float:
    """Pictures per second of ALVideoDevice, as fast as they are asked for."""
    device = stage.naoqi.service("ALVideoDevice")
    handle = device.subscribeCamera("bench", 0, vision.VGA, BGR, 30)
    try:
        device.getImageRemote(handle)
        count, began = 0, time.monotonic()
        while time.monotonic() < began + WATCHED:
            device.getImageRemote(handle)
            device.releaseImage(handle)
            count += 1
        return count / (time.monotonic() - began)
    finally:
        device.unsubscribe(handle)
