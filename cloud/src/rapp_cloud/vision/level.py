"""A picture as an upright camera would have taken it, and its straight edges.

In such a picture upright edges are columns, and the horizon is the middle row. With x and y measured from the middle in focal
lengths, a plane that stands upright has 1/depth = k (1 + t x), where t is the tangent of the direction it faces; so the level lines
on it are y = c (1 + t x): they meet the horizon where 1 + t x = 0.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Array = NDArray[np.float64]

STEEPEST = math.radians(30)  # from a column of the picture as taken, for an edge that may be upright
PLUMB = math.radians(0.3)  # within which long edges agree about what is upright
SIDE_BY_SIDE = 0.05  # rad between edges that say nothing of how far the camera looks up
SHORTEST = 0.06  # of the picture's height, of an edge that counts
CANDIDATES = 24  # longest edges of which each pair may say what is upright


@dataclass(frozen=True)
class Level:
    """The levelled picture; `edges` are rows x1, y1, x2, y2 in focal lengths from its middle, x1 <= x2, y downwards."""

    image: Image
    seen: NDArray[np.bool_]  # which of its pixels the camera saw
    middle: tuple[float, float]  # column and row straight ahead, at the horizon
    focal: float  # pixels
    height: int  # of the picture as taken, pixels
    edges: Array

    def pixels(self, x: Array, y: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Columns and rows of points."""
        u, v = self.middle
        return np.rint(x * self.focal + u).astype(np.intp), np.rint(y * self.focal + v).astype(np.intp)


def level(image: Image, field_of_view: float) -> Level | None:
    """Level a picture whose camera sees `field_of_view` rad from left to right; None when nothing in it stands upright."""
    height, width = image.shape[:2]
    focal = width / 2 / math.tan(field_of_view / 2)
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    found = (_segments(image) - np.tile(middle, 2)) / focal
    steep = found[_steep(found)]
    planes = np.cross(_rays(steep[:, :2]), _rays(steep[:, 2:]))
    lengths = np.hypot(*(steep[:, 2:] - steep[:, :2]).T)
    down = _plumb(planes, lengths, 1 / focal)
    if down is None:
        return None
    turn = _turn(down)
    image, seen, centre = _warped(image, focal, turn)
    return Level(image, seen, centre, focal, height, _turned(found, turn))


def _warped(image: Image, focal: float, turn: Array) -> tuple[Image, NDArray[np.bool_], tuple[float, float]]:
    """The picture turned, as large as it then is; which pixels of it were seen; what is straight ahead."""
    height, width = image.shape[:2]
    lens = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1.0]])
    corners = _rays(np.array([[x, y] for x in (0.0, width - 1.0) for y in (0.0, height - 1.0)])) @ np.linalg.inv(lens).T @ turn.T
    ends = corners[:, :2] / corners[:, 2:] * focal
    left, top = np.maximum(ends.min(axis=0), (-width, -height))
    right, bottom = np.minimum(ends.max(axis=0), (width, height))
    size = (math.ceil(right - left), math.ceil(bottom - top))
    placed = np.array([[focal, 0, -left], [0, focal, -top], [0, 0, 1.0]]) @ turn @ np.linalg.inv(lens)
    turned = cv2.warpPerspective(image, placed, size, borderMode=cv2.BORDER_REPLICATE)
    seen = cv2.warpPerspective(np.full((height, width), 255, np.uint8), placed, size, borderValue=(0.0,))
    return np.asarray(turned, np.uint8), np.asarray(seen == 255, bool), (float(-left), float(-top))


def _segments(image: Image) -> Array:
    """Straight edges of every channel, in pixels."""
    height = image.shape[0]
    detector = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD)
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    found = [detector.detect(layer)[0] for layer in (grey, *cv2.split(image))]
    rows = [np.asarray(lines, np.float64).reshape(-1, 4) for lines in found if lines is not None]
    segments = np.concatenate(rows) if rows else np.empty((0, 4))
    long = np.hypot(*(segments[:, 2:] - segments[:, :2]).T) >= SHORTEST * height / 2
    segments = np.asarray(segments[long], np.float64)
    swap = segments[:, 0] > segments[:, 2]
    segments[swap] = segments[swap][:, [2, 3, 0, 1]]
    return segments


def _steep(segments: Array) -> NDArray[np.bool_]:
    dx, dy = (segments[:, 2:] - segments[:, :2]).T
    return np.asarray(np.abs(dx) < math.tan(STEEPEST) * np.abs(dy), bool)


def _rays(points: Array) -> Array:
    return np.column_stack([points, np.ones(len(points))])


def _plumb(planes: Array, lengths: Array, pixel: float) -> Array | None:
    """The direction that lies in most of the planes through the eye and an edge; a long edge is a surer one."""
    if len(planes) < 2:
        return None
    planes = planes / np.linalg.norm(planes, axis=1, keepdims=True)
    weights, tolerances = lengths**2, np.maximum(math.sin(PLUMB), pixel / lengths)
    best, most = None, 0.0
    for pair in _pairs(lengths):
        down = np.cross(*planes[pair])
        size = np.linalg.norm(down)
        if size < SIDE_BY_SIDE:
            continue
        down = down / size * (1 if down[1] >= 0 else -1)
        if down[1] < math.cos(STEEPEST):
            continue
        off = np.abs(planes @ down) / tolerances
        agreed = float((weights * np.clip(1 - off**2, 0, None)).sum())
        if agreed > most:
            most, best = agreed, off < 1
    if best is None:
        return None
    _, _, axes = np.linalg.svd(planes[best] * lengths[best, None])
    down = axes[-1] * (1 if axes[-1][1] >= 0 else -1)
    return np.asarray(down, np.float64) if down[1] > math.cos(STEEPEST) else None


def _pairs(lengths: Array) -> Iterator[list[int]]:
    longest = np.argsort(lengths)[::-1][:CANDIDATES]
    return (list(pair) for pair in itertools.combinations(longest.tolist(), 2))


def _turn(down: Array) -> Array:
    """The smallest rotation that takes `down` to the picture's own down."""
    goal = np.array([0.0, 1.0, 0.0])
    axis = np.cross(down, goal)
    sine, cosine = np.linalg.norm(axis), float(down @ goal)
    if sine < 1e-9:
        return np.eye(3)
    return np.asarray(cv2.Rodrigues(axis / sine * math.atan2(sine, cosine))[0], np.float64)


def _turned(segments: Array, turn: Array) -> Array:
    ends = []
    for part in (segments[:, :2], segments[:, 2:]):
        rays = _rays(part) @ turn.T
        ends.append(rays[:, :2] / rays[:, 2:])
    turned = np.hstack(ends)
    swap = turned[:, 0] > turned[:, 2]
    turned[swap] = turned[swap][:, [2, 3, 0, 1]]
    return turned
