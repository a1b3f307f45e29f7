"""image_raw, its compressed form and camera_info of each camera (sensor_msgs; REP 104)."""

import math
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from rapp_core.body_ports import Camera, Picture
from rapp_core.errors import Bug
from rapp_core.ros.topics.streams import Stream, Topic

FIELD_OF_VIEW = (math.radians(60.97), math.radians(47.64))  # across, down: NAO V5's cameras
QUALITY = 80  # of JPEG, percent


def camera_stream(camera: Camera, name: str, resolution: int, period: float, idle: Callable[[], None]) -> Stream:
    """Topics camera/NAME/image_raw, image_raw/compressed and camera_info; `name` is top or bottom, `period` in s."""
    frame = f"camera_{name}_optical_frame"

    def topic(path: str, cls: Any, message: Any) -> Topic:
        publisher = rospy.Publisher(f"camera/{name}/{path}", cls, queue_size=2, tcp_nodelay=True)
        return Topic(publisher, lambda picture: message(picture, frame))

    topics = [
        topic("image_raw", Image, image),
        topic("image_raw/compressed", CompressedImage, compressed),
        topic("camera_info", CameraInfo, camera_info),
    ]
    return Stream(f"camera {name}", period, lambda: camera.capture(name, resolution), topics, idle)


def image(picture: Picture, frame: str) -> Image:
    """A picture as bgr8."""
    message = Image(height=picture.height, width=picture.width, encoding="bgr8", step=3 * picture.width, data=picture.data)
    return _headed(message, picture, frame)


def compressed(picture: Picture, frame: str) -> CompressedImage:
    """A picture as JPEG. Raises Bug."""
    pixels = np.frombuffer(picture.data, np.uint8).reshape(picture.height, picture.width, 3)
    done, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    if not done:
        raise Bug("cannot compress a picture: OpenCV does not say why; report this")
    return _headed(CompressedImage(format="bgr8; jpeg compressed bgr8", data=data.tobytes()), picture, frame)


def camera_info(picture: Picture, frame: str) -> CameraInfo:
    """The camera as a pinhole without distortion."""
    focal = [size / 2 / math.tan(angle / 2) for size, angle in zip((picture.width, picture.height), FIELD_OF_VIEW, strict=True)]
    (fx, fy), cx, cy = focal, picture.width / 2 - 0.5, picture.height / 2 - 0.5
    message = CameraInfo(height=picture.height, width=picture.width, distortion_model="plumb_bob", D=[0.0] * 5)
    message.K = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    message.R = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    message.P = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return _headed(message, picture, frame)


def _headed(message: Any, picture: Picture, frame: str) -> Any:
    message.header.stamp, message.header.frame_id = rospy.Time.from_sec(picture.stamp), frame
    return message
