"""Virtual receptor r_cam on ALVideoDevice."""

import contextlib
import threading
from typing import Any

from rapp_core.body_ports import Picture
from rapp_core.errors import CoreError, Refused, Unreachable
from rapp_core.robot.naoqi.connection import Connection

CAMERAS = {"top": 0, "bottom": 1}
BGR = 13  # NAOqi's number of the colour space
FAST, SLOW = 30, 5  # pictures/s to ask for: up to VGA, and above
VGA = 2
RESOLUTIONS = range(4)  # to 4VGA
LAYERS = 3
TRIES = 2  # the first picture after a camera has been woken may not be there yet


class NaoqiCamera:
    """See `body_ports.Camera`. Each camera and resolution is subscribed at its first picture, and stays so until `close`."""

    def __init__(self, connection: Connection, name: str) -> None:
        """`name` is that under which the cameras are asked to work."""
        self._connection = connection
        self._name = name
        self._lock = threading.Lock()
        self._device: Any = None  # the module that gave the handles: another one after the session was lost
        self._handles: dict[tuple[int, int], str] = {}

    def capture(self, camera: str, resolution: int) -> Picture:
        """See `body_ports.Camera`."""
        with self._lock:
            for _ in range(TRIES):
                image = self._image(CAMERAS[camera], resolution)
                if image is not None:
                    return _picture(image, camera)
        raise Unreachable(f"cannot take a picture: the {camera} camera gives none; try again")

    def set_parameter(self, camera: str, parameter: int, value: int) -> None:
        """See `body_ports.Camera`."""
        number = CAMERAS[camera]
        if self._connection.call("ALVideoDevice", "setParameter", number, parameter, value):
            return
        wanted = f"cannot set parameter {parameter} of the {camera} camera to {value}"
        try:
            least, most = self._connection.call("ALVideoDevice", "getParameterRange", number, parameter)[:2]
        except (Refused, ValueError) as error:
            raise Refused(f"{wanted}: it has no such parameter; see NAOqi's list of camera parameters") from error
        raise Refused(f"{wanted}: {least} to {most} are possible, and not while the camera sets it by itself")

    def close(self) -> None:
        """See `body_ports.Camera`."""
        with self._lock:
            handles, self._handles = self._handles, {}
            if self._connection.present:
                for handle in handles.values():
                    with contextlib.suppress(CoreError):
                        self._connection.call("ALVideoDevice", "unsubscribe", handle)

    def _image(self, camera: int, resolution: int) -> Any:
        call = self._connection.call
        handle = self._handle(camera, resolution)
        try:
            image = call("ALVideoDevice", "getImageRemote", handle)
        except Refused:
            self._handles.pop((camera, resolution), None)  # somebody has taken it away: subscribe anew the next time
            raise
        call("ALVideoDevice", "releaseImage", handle)
        return image if image and len(image) > 6 and image[6] else None

    def _handle(self, camera: int, resolution: int) -> str:
        device = self._connection.service("ALVideoDevice")
        if device is not self._device:
            self._device = device
            self._handles.clear()
        key = (camera, resolution)
        if key not in self._handles:
            name = _subscription(self._name, camera, resolution)
            rate = FAST if resolution <= VGA else SLOW
            self._handles[key] = str(self._connection.call("ALVideoDevice", "subscribeCamera", name, camera, resolution, BGR, rate))
        return self._handles[key]


def subscriptions(name: str) -> list[str]:
    """All names under which the cameras may have been subscribed for `name`."""
    return [_subscription(name, camera, resolution) for camera in CAMERAS.values() for resolution in RESOLUTIONS]


def _subscription(name: str, camera: int, resolution: int) -> str:
    return f"{name}_{camera}_{resolution}"


def _picture(image: Any, camera: str) -> Picture:
    """NAOqi's list: width, height, layers, colour space, s, us, data; old clients see the data as text."""
    width, height, data = int(image[0]), int(image[1]), image[6]
    whole = data.encode("latin-1") if isinstance(data, str) else bytes(data)
    if len(whole) != width * height * LAYERS:
        raise Unreachable(f"cannot take a picture: {len(whole)} bytes came for {width} x {height} pixels; try again")
    return Picture(width, height, whole, float(image[4]) + float(image[5]) * 1e-6, camera)
