"""What a camera's parameters make of the light that falls into it: from a drawn picture to the bytes of ALVideoDevice.

Pure functions of pictures as uint8 arrays (height, width, red-green-blue).
"""

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from rapp_nao_sim.world import cameras
from rapp_nao_sim.world.cameras import Settings

Picture = npt.NDArray[np.uint8]

AIM = 2.5  # mean grey that automatic exposure aims at, per unit of brightness
REACH = (0.6, 1.4)  # least and greatest exposure that it chooses, times the normal one; beyond, the picture is dark or bright
_NORMAL = cameras.PARAMETERS[cameras.EXPOSURE].default
_DAYLIGHT = cameras.PARAMETERS[cameras.WHITE].default  # K, at which colours stay as they are
_MIDDLE = 128.0


def develop(light: Picture, settings: Settings, colour: int) -> tuple[bytes, float]:
    """The picture in a colour space, row by row, and its exposure (1 is normal)."""
    exposure = exposed(light, settings)
    picture = _graded(light, exposure, settings)
    if settings[cameras.SATURATION] != 128 or settings[cameras.HUE]:
        picture = _coloured(picture, settings[cameras.SATURATION] / 128, settings[cameras.HUE])
    if settings[cameras.SHARPNESS]:
        soft = cv2.GaussianBlur(picture, (0, 0), 1.0)
        share = settings[cameras.SHARPNESS] * 0.5
        picture = _picture(cv2.addWeighted(picture, 1 + share, soft, -share, 0))
    if settings[cameras.FLIP_ACROSS]:
        picture = picture[:, ::-1]
    if settings[cameras.FLIP_DOWN]:
        picture = picture[::-1]
    return _in(colour, np.ascontiguousarray(picture)).tobytes(), exposure


def exposed(light: Picture, settings: Settings) -> float:
    """How many times the normal light the sensor gathers."""
    if not settings[cameras.AUTO_EXPOSURE]:
        return settings[cameras.EXPOSURE] / _NORMAL * settings[cameras.GAIN] / 32
    least, most = REACH
    return float(np.clip(AIM * settings[cameras.BRIGHTNESS] / max(1.0, _metered(light, settings)), least, most))


def _metered(light: Picture, settings: Settings) -> float:
    """Brightness of the picture as its exposure is measured."""
    small = cv2.resize(cv2.cvtColor(light, cv2.COLOR_RGB2GRAY), (16, 12), interpolation=cv2.INTER_AREA).astype(float)
    match settings[cameras.METERING]:
        case 2:
            return float(np.percentile(small, 80))
        case 3:
            return float(np.percentile(small, 20))
        case 1:
            share = 0.15 + 0.15 * settings[cameras.BACKLIGHT]  # of the middle, against what is around it
            return float(share * small[3:9, 4:12].mean() + (1 - share) * small.mean())
        case _:
            return float(small.mean())


def _graded(light: Picture, exposure: float, settings: Settings) -> Picture:
    """Exposure, white balance and contrast, which act on every value by itself: one table for each of red, green, blue."""
    levels = np.arange(256) * exposure
    slope = settings[cameras.CONTRAST] / 32
    tables = [np.clip((levels * share - _MIDDLE) * slope + _MIDDLE, 0, 255) for share in _balance(light, settings)]
    return _picture(cv2.LUT(light, np.stack(tables, axis=-1).round().astype(np.uint8)[None]))


def _balance(light: Picture, settings: Settings) -> tuple[float, float, float]:
    """Factors of red, green and blue."""
    if settings[cameras.AUTO_WHITE]:
        red, green, blue = (max(1.0, part) for part in cv2.mean(light)[:3])
        # A part of the way to grey on average, or a wooden floor would turn grey.
        return float(np.clip((green / red) ** 0.3, 0.8, 1.25)), 1.0, float(np.clip((green / blue) ** 0.3, 0.8, 1.25))
    warmth = settings[cameras.WHITE] / _DAYLIGHT  # told that the light is bluer than it is, the camera adds red
    return warmth**0.6, 1.0, warmth**-0.6


def _coloured(picture: Picture, saturation: float, hue: int) -> Picture:
    """Colours stretched away from grey and turned round it, in the plane of U and V."""
    yuv = cv2.cvtColor(picture, cv2.COLOR_RGB2YUV).astype(np.float32)
    turn = np.exp(1j * np.radians(hue)) * saturation
    colours = (yuv[..., 1] - _MIDDLE + 1j * (yuv[..., 2] - _MIDDLE)) * turn
    yuv[..., 1], yuv[..., 2] = colours.real + _MIDDLE, colours.imag + _MIDDLE
    return _picture(cv2.cvtColor(np.clip(yuv, 0, 255).astype(np.uint8), cv2.COLOR_YUV2RGB))


def _in(colour: int, picture: Picture) -> Picture:
    match colour:
        case cameras.RGB:
            return picture
        case cameras.BGR:
            return _picture(cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        case cameras.LUMA:
            return _picture(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY))
        case cameras.HSY:
            hsy = cv2.cvtColor(picture, cv2.COLOR_RGB2HSV_FULL)
            hsy[..., 2] = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
            return _picture(hsy)
    yuv = _picture(cv2.cvtColor(picture, cv2.COLOR_RGB2YUV))
    if colour == cameras.YUV:
        return yuv
    pairs = np.empty((*yuv.shape[:2], 2), np.uint8)  # Y of each pixel; U and V of every second
    pairs[..., 0], pairs[:, 0::2, 1], pairs[:, 1::2, 1] = yuv[..., 0], yuv[:, 0::2, 1], yuv[:, 0::2, 2]
    return pairs


def _picture(array: Any) -> Picture:
    return np.asarray(array, np.uint8)
