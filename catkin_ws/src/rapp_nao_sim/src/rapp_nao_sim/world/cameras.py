"""The NAO's two cameras in tables: where they sit, what they see, their picture sizes, colour spaces and parameters.

Figures: NAO V5's technical pages (camera MT9M114) and the definitions of ALVideoDevice of NAOqi 2.1.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rapp_nao_sim.world.model import Vector

WIDE = math.radians(60.97)  # rad, horizontal field of view
HIGH = math.radians(47.64)  # rad, vertical
LINK = "Head"  # what carries the cameras
FASTEST = 30  # pictures per second


@dataclass(frozen=True)
class Camera:
    """A camera in the head's frame, looking ahead and down by `pitch`."""

    name: str
    offset: Vector  # m
    pitch: float  # rad


@dataclass(frozen=True)
class Parameter:
    """A setting of a camera: NAOqi's name, least, greatest and first value; not `settable`: it only tells."""

    name: str
    least: int
    most: int
    default: int
    settable: bool = True


CAMERAS = {0: Camera("CameraTop", (0.05871, 0.0, 0.06364), 0.0209), 1: Camera("CameraBottom", (0.05071, 0.0, 0.01774), 0.6929)}
SIZES = {0: (160, 120), 1: (320, 240), 2: (640, 480), 3: (1280, 960), 7: (80, 60), 8: (40, 30)}  # pixels
LUMA, YUV422, YUV, RGB, HSY, BGR = 0, 9, 10, 11, 12, 13
LAYERS = {LUMA: 1, YUV422: 2, YUV: 3, RGB: 3, HSY: 3, BGR: 3}  # bytes of a pixel

BRIGHTNESS, CONTRAST, SATURATION, HUE, GAIN = 0, 1, 2, 3, 6
FLIP_ACROSS, FLIP_DOWN, AUTO_EXPOSURE, AUTO_WHITE = 7, 8, 11, 12
RESOLUTION, RATE, EXPOSURE, SELECT, RESET = 14, 15, 17, 18, 19
METERING, SHARPNESS, WHITE, BACKLIGHT = 22, 24, 33, 34

PARAMETERS: dict[int, Parameter] = {
    BRIGHTNESS: Parameter("Brightness", 0, 255, 55),  # what the automatic exposure aims at
    CONTRAST: Parameter("Contrast", 16, 64, 32),
    SATURATION: Parameter("Saturation", 0, 255, 128),
    HUE: Parameter("Hue", -180, 180, 0),  # degrees
    GAIN: Parameter("Gain", 32, 255, 32),  # only without automatic exposure
    FLIP_ACROSS: Parameter("HorizontalFlip", 0, 1, 0),
    FLIP_DOWN: Parameter("VerticalFlip", 0, 1, 0),
    AUTO_EXPOSURE: Parameter("AutoExposition", 0, 1, 1),
    AUTO_WHITE: Parameter("AutoWhiteBalance", 0, 1, 1),
    RESOLUTION: Parameter("Resolution", 0, 8, 1, settable=False),
    RATE: Parameter("FrameRate", 1, FASTEST, 5, settable=False),
    EXPOSURE: Parameter("Exposure", 1, 2500, 250),  # 0.1 ms, only without automatic exposure
    SELECT: Parameter("CameraSelect", 0, 1, 0),
    RESET: Parameter("ResetCameraRegister", 0, 1, 0),
    METERING: Parameter("ExposureAlgorithm", 0, 3, 1),  # 0 whole picture, 1 its middle more, 2 bright parts, 3 dark parts
    SHARPNESS: Parameter("Sharpness", -1, 7, 0),
    WHITE: Parameter("WhiteBalance", 2700, 6500, 5200),  # K, only without automatic white balance
    BACKLIGHT: Parameter("BacklightCompensation", 0, 4, 1),
    35: Parameter("KeepAlive", 0, 1, 0),
}
"""By NAOqi's number."""

Settings = Mapping[int, int]
"""Values of parameters, by number."""


def defaults() -> dict[int, int]:
    """Every parameter at its first value."""
    return {number: parameter.default for number, parameter in PARAMETERS.items()}
