"""QR codes in a picture (the original platform's qr_detection), of several sizes, by OpenCV's detector."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rapp_cloud.vision.level import Image

SCALES = (1.0, 2.0)  # of the picture: small codes are found when it is enlarged
LARGEST = 2_600_000  # pixels that are looked at


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
    """All codes that can be read, from left to right; each once."""
    found: list[Code] = []
    for scale in SCALES:
        if scale > 1 and image.shape[0] * image.shape[1] * scale**2 > LARGEST:
            continue
        large = image if scale == 1 else cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
        for code in _read(large, scale):
            if not any(_same(code, other) for other in found):
                found.append(code)
    return sorted(found, key=lambda code: code.centre)


def _read(image: NDArray[np.generic], scale: float) -> list[Code]:
    good, messages, corners, _ = cv2.QRCodeDetector().detectAndDecodeMulti(np.asarray(image, np.uint8))
    if not good:
        return []
    places = np.asarray(corners, float) / scale
    return [Code(text, tuple((float(x), float(y)) for x, y in place)) for text, place in zip(messages, places, strict=True) if text]


def _same(one: Code, other: Code) -> bool:
    near = np.abs(np.subtract(one.centre, other.centre)).max() < 0.5 * np.ptp(np.array(other.corners), axis=0).max()
    return one.message == other.message and bool(near)
