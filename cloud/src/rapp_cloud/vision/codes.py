"""QR codes in a picture (the original platform's qr_detection), of several sizes, by OpenCV's detector."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from rapp_cloud.vision.level import Image

LARGEST = 5_000_000  # pixels that are looked at


@dataclass(frozen=True)
class Code:
    """A code's text and its corners in pixels: top left, top right, bottom right, bottom left, as the code is written."""

    message: str
    corners: tuple[tuple[float, float], ...]

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of the corners."""
        x, y = np.mean(self.corners, axis=0)
        return float(x), float(y)


def read_codes(image: Image) -> list[Code]:
    """All codes that can be read, from left to right; each once.

    OpenCV has two detectors that miss different codes; small ones are found when the picture is enlarged.
    """
    found: list[Code] = []
    for detector, scale in ((cv2.QRCodeDetector(), 1), (cv2.QRCodeDetectorAruco(), 1), (cv2.QRCodeDetectorAruco(), 2)):
        if image.shape[0] * image.shape[1] * scale**2 <= LARGEST:
            found += [code for code in _read(detector, image, scale) if not any(_same(code, other) for other in found)]
    return sorted(found, key=lambda code: code.centre)


def _read(detector: Any, image: Image, scale: int) -> list[Code]:
    large = image if scale == 1 else cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    good, messages, corners, _ = detector.detectAndDecodeMulti(large)
    if not good:
        return []
    places = (np.asarray(corners, float) + 0.5) / scale - 0.5
    return [Code(text, tuple((float(x), float(y)) for x, y in place)) for text, place in zip(messages, places, strict=True) if text]


def _same(one: Code, other: Code) -> bool:
    near = np.abs(np.subtract(one.centre, other.centre)).max() < 0.5 * np.ptp(np.array(other.corners), axis=0).max()
    return one.message == other.message and bool(near)
