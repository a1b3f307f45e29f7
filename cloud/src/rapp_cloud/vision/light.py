"""How bright a lamp in the middle of a picture is against what is round it (the original platform's hazard_detection_light_check).

The lamp is the even patch in the middle: it grows from there until its brightness or colour changes at an edge.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rapp_cloud.vision.level import Image

WORKING = 320  # pixels that the picture is wide when it is looked at
SEED = 0.012  # of the width: radius of the patch in the middle that the lamp is grown from
SMOOTH = 3.0  # levels of 256 by which neighbours in a lamp may differ
THIN = 0.25  # of the patch's size, of a part that does not belong to the lamp
SMALLEST, LARGEST = 0.002, 0.3  # of the picture, that a lamp may fill
RING = 0.8  # of the lamp's radius: how far round it the surroundings reach
DARK, BRIGHT = 0.9, 1.1  # times the brightness of the surroundings: a lamp as dark as this is off, one as bright as this is on
SURE = 0.7  # confidence from which the answer counts
ON = 50  # level from which a lamp counts as on
STEP = 12.0  # levels of 256: a contrast at which the lamp's edge is clear


@dataclass(frozen=True)
class Light:
    """How brightly the lamp shines, 0 to 100, and how sure that is, 0 to 1; level None: there is no lamp in the middle."""

    level: int | None
    confidence: float

    @property
    def sure(self) -> bool:
        """Whether the level is to be relied on."""
        return self.level is not None and self.confidence >= SURE


def look_at_lamp(image: Image) -> Light:
    """Compare what is in the middle with what is round it."""
    height, width = image.shape[:2]
    scale = WORKING / width
    small = cv2.resize(image, (WORKING, max(1, round(height * scale))), interpolation=cv2.INTER_AREA)
    smooth = np.asarray(cv2.bilateralFilter(cv2.medianBlur(small, 3), 7, 12, 4), np.uint8)
    lamp = _patch(smooth)
    area = int(lamp.sum())
    if not SMALLEST * lamp.size <= area <= LARGEST * lamp.size or _cut(lamp):
        return Light(None, 0.0)
    grey = cv2.cvtColor(small, cv2.COLOR_BGR2GRAY).astype(float)
    inside, outside = float(np.median(grey[lamp])), float(np.median(grey[_ring(lamp, area)]))
    share = math.log(max(inside, 1.0) / max(outside, 1.0) / DARK) / math.log(BRIGHT / DARK)
    level = round(100 * min(1.0, max(0.0, share)))
    # Between the two it may be either; and of a lamp that is hardly to be told from the wall nothing is known.
    decided = min(1.0, abs(share - 0.5) * 2)
    clear = min(1.0, _contrast(smooth, lamp) / STEP)
    return Light(level, decided * clear)


def _patch(image: Image) -> NDArray[np.bool_]:
    """What is even with the middle of a picture."""
    height, width = image.shape[:2]
    mask = np.zeros((height + 2, width + 2), np.uint8)
    reach = max(1, round(SEED * width))
    step, how = (SMOOTH,) * 3, 8 | (255 << 8) | cv2.FLOODFILL_MASK_ONLY
    for x, y in ((0, 0), (-reach, 0), (reach, 0), (0, -reach), (0, reach)):
        cv2.floodFill(image.copy(), mask, (width // 2 + x, height // 2 + y), (0.0,), step, step, how)
    found = mask[1:-1, 1:-1]
    thin = max(3, round(THIN * math.sqrt(np.count_nonzero(found))) | 1)  # a stand, as dark as a lamp that is off
    found = cv2.morphologyEx(found, cv2.MORPH_OPEN, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (thin, thin)))
    _, labels = cv2.connectedComponents(found)
    own = labels[height // 2 - reach : height // 2 + reach + 1, width // 2 - reach : width // 2 + reach + 1]
    numbers, counts = np.unique(own[own > 0], return_counts=True)
    return np.asarray(labels == numbers[counts.argmax()] if len(numbers) else np.zeros_like(labels), bool)


def _cut(lamp: NDArray[np.bool_]) -> bool:
    """Whether it reaches beyond the picture."""
    return bool(lamp[0].any() or lamp[-1].any() or lamp[:, 0].any() or lamp[:, -1].any())


def _grown(lamp: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * by + 1, 2 * by + 1))
    return np.asarray(cv2.dilate(lamp.astype(np.uint8), kernel) > 0, bool)


def _ring(lamp: NDArray[np.bool_], area: int) -> NDArray[np.bool_]:
    return _grown(lamp, 4 + max(3, round(RING * math.sqrt(area / math.pi)))) & ~_grown(lamp, 4)


def _contrast(image: Image, lamp: NDArray[np.bool_]) -> float:
    """Between the lamp's rim and what is just outside of it: the median of the greatest difference of a channel."""
    rim = lamp & ~(cv2.erode(lamp.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0)
    outside = _grown(lamp, 4) & ~_grown(lamp, 2)
    middles = [np.median(image[part].astype(float), axis=0) for part in (rim, outside)]
    return float(np.abs(middles[0] - middles[1]).max())
