"""Vision API (deliverable section 4.5.3)."""

import logging
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rapp_api.core_agent import current
from rapp_api.errors import Invalid, RappError

QQVGA, QVGA, VGA, QUAD_VGA = 0, 1, 2, 3
"""Resolutions: 160 x 120, 320 x 240, 640 x 480, 1280 x 960."""
TOP, BOTTOM = 0, 1
"""Numbers of the cameras in `set_camera_param`."""

_log = logging.getLogger(__name__)


def capture_image(camera_id: str = "top", camera_resolution: int = VGA) -> NDArray[np.uint8]:
    """A picture of the camera "top" or "bottom" as array (height, width, 3) in BGR.

    As the deliverable wants it, the array is empty when the picture could not be taken; the log says why. Raises Invalid.
    """
    try:
        width, height, data = current().capture_image(camera_id, camera_resolution)
    except Invalid:
        raise
    except RappError as error:
        _log.warning("%s", error)
        return np.empty((0, 0, 3), np.uint8)
    return np.frombuffer(data, np.uint8).reshape(height, width, 3)


def set_camera_param(camera_id: int, camera_parameter_id: int, new_value: int) -> None:
    """Set a parameter of the camera 0 (top) or 1 (bottom), by NAOqi's number, such as 0 brightness. Raises Refused, Invalid."""
    current().set_camera_param(camera_id, camera_parameter_id, new_value)


def set_camera_params(camera_id: int, camera_parameter_id: Sequence[int], new_value: Sequence[int]) -> list[bool]:
    """Set several parameters; gives of each whether the camera has taken it. Raises Invalid."""
    return current().set_camera_params(camera_id, list(camera_parameter_id), list(new_value))
