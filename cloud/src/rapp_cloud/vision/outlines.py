"""Upright rectangles in a levelled picture, such as a door's leaf, whichever way they face."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from rapp_cloud.vision.level import Array, Level

BINS = 12  # directions of edges that are told apart; a line is supported by its own and its two neighbours
NEAR = 2  # pixels beside a line where its edge may be
STEPS = 24  # points at which a line is looked at
FAINTEST = 24.0  # gradient of an edge, in 8-bit levels of Sobel's operator: a step of 6 levels
CLEAR = 75.0  # per cent of the edges that are fainter than one that counts in full
FULL = 200  # of 8 bits, for an edge that counts in full
NOISY = 7.0  # times the picture's own noise
TALL = 0.16  # of the picture's height that a column of edges has at least
COLUMNS = 28  # columns of edges that are looked at
SPANNED = 0.5  # of a rectangle's width that one of its level edges has at least in one piece
LEAST = 0.3  # share of each of its edges that must be seen
BESIDE = 0.04  # of the picture's width that it may reach beyond
THINNEST = 0.012  # of the picture's width: a narrower rectangle says nothing of its direction
FITS = 4  # rounds of fitting
TOO_FAR = 0.07  # of its height below its end where an upright edge must have ended


@dataclass(frozen=True)
class Outline:
    """An upright rectangle: left and right edge x1 < x2, its direction t, its level edges y = c (1 + t x), top c < 0 < bottom.

    `top` is None when the picture ends below it. Lengths are in depths of the plane straight ahead.
    """

    x1: float
    x2: float
    t: float
    top: float | None
    bottom: float
    support: float  # 0 to 1: share of its edges that are seen
    weakest: float  # share of the one that is seen least

    @property
    def width(self) -> float:
        """True width."""
        ends = [np.array([x, 1.0]) / (1 + self.t * x) for x in (self.x1, self.x2)]
        return float(np.linalg.norm(ends[1] - ends[0]))

    @property
    def height(self) -> float | None:
        """True height."""
        return None if self.top is None else self.bottom - self.top


class Edges:
    """Where edges of each direction are in a levelled picture."""

    def __init__(self, picture: Level) -> None:
        self._picture = picture
        edge, tangent, strength = _edges(picture.image)
        self._seen = cv2.erode(picture.seen.astype(np.uint8), np.ones((7, 7), np.uint8), borderValue=0).astype(bool)
        edge &= self._seen
        self.size = edge.shape
        clear = float(np.percentile(strength[edge], CLEAR)) if edge.any() else 1.0
        weight = np.sqrt(np.clip(strength / clear, 0, 1)) * edge * FULL
        near = np.ones((2 * NEAR + 1, 2 * NEAR + 1), np.uint8)
        number = np.floor(tangent / math.pi * BINS).astype(int) % BINS
        plain = [np.where(number == each, weight, 0).astype(np.uint8) for each in range(BINS)]
        wide = [np.maximum(np.maximum(plain[each - 1], plain[each]), plain[(each + 1) % BINS]) for each in range(BINS)]
        self._strength = cv2.dilate(np.where(edge, strength, 0), near)
        self._maps = np.stack([cv2.dilate(each, near) for each in wide])
        middle = BINS // 2
        upright = np.maximum(plain[middle], plain[middle - 1])
        self._columns = (upright > 0).sum(axis=0).astype(float)
        across = np.where(self._seen, cv2.dilate(upright, near), 0).astype(np.int64)
        self._down, self._seen_down = _summed(across), _summed(self._seen.astype(np.int64))

    def columns(self) -> list[float]:
        """x of the columns with most upright edges."""
        sums = np.convolve(self._columns, [0.5, 1, 0.5], "same")
        order, found = np.argsort(sums)[::-1], list[int]()
        for column in order:
            if sums[column] < TALL * self._picture.height or len(found) == COLUMNS:
                break
            if all(abs(column - other) > 2 for other in found):
                found.append(int(column))
        return sorted((column - self._picture.middle[0]) / self._picture.focal for column in found)

    def upright(self, x: float, y1: float, y2: float) -> float | None:
        """Share of an upright line that is an edge; None when it is not in the picture."""
        (column,), _ = self._picture.pixels(np.array([x]), np.zeros(1))
        _, rows = self._picture.pixels(np.zeros(2), np.array([y1, y2]))
        first, last = np.clip(rows, 0, self.size[0])
        if not 0 <= column < self.size[1]:
            return None
        seen = self._seen_down[last, column] - self._seen_down[first, column]
        return float(self._down[last, column] - self._down[first, column]) / float(FULL * seen) if seen >= 4 else None

    def level(self, x1: float, x2: float, t: float, c: Array) -> Array:
        """For each c the share of the line y = c (1 + t x), from x1 to x2, that is an edge; NaN for what is not in the picture."""
        rows, columns, inside = self._along(x1, x2, t, c)
        direction = np.floor((np.arctan(c * t) % math.pi) / math.pi * BINS).astype(int) % BINS
        hit = np.where(inside, self._maps[direction[:, None], rows, columns], 0) / FULL
        seen = inside.sum(axis=1)
        return np.where(seen >= STEPS // 2, hit.sum(axis=1) / np.maximum(seen, 1), np.nan)

    def strength(self, x1: float, x2: float, t: float, c: Array) -> Array:
        """For each c how strong the edge is along most of that line; 0 for what is not in the picture."""
        rows, columns, inside = self._along(x1, x2, t, c)
        values = np.sort(np.where(inside, self._strength[rows, columns], 0), axis=1)
        return np.where(inside.sum(axis=1) >= STEPS // 2, values[:, STEPS // 3], 0.0)

    def _along(self, x1: float, x2: float, t: float, c: Array) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.bool_]]:
        """Rows and columns of points on each line, and which of them were seen."""
        inset = (x2 - x1) * 0.04
        x = np.linspace(x1 + inset, x2 - inset, STEPS)
        y = c[:, None] * (1 + t * x)[None]
        columns, rows = self._picture.pixels(np.broadcast_to(x, y.shape), y)
        inside = (rows >= 0) & (rows < self.size[0]) & (columns >= 0) & (columns < self.size[1])
        rows, columns = np.where(inside, rows, 0), np.where(inside, columns, 0)
        return rows, columns, inside & self._seen[rows, columns]


def _summed(parts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Down each column."""
    return np.vstack([np.zeros((1, parts.shape[1]), np.int64), parts.cumsum(axis=0)])


def _edges(image: NDArray[np.uint8]) -> tuple[NDArray[np.bool_], Array, Array]:
    """Thin edges, the direction of each from 0 to pi (0 is level, pi / 2 upright), and its strength."""
    smooth = cv2.GaussianBlur(image, (3, 3), 0)
    dx = np.stack([cv2.Sobel(layer, cv2.CV_16S, 1, 0) for layer in cv2.split(smooth)])
    dy = np.stack([cv2.Sobel(layer, cv2.CV_16S, 0, 1) for layer in cv2.split(smooth)])
    strength = np.hypot(dx, dy)
    noise = float(np.median(strength))
    least = max(FAINTEST, NOISY * noise / 2)
    edge = np.zeros(image.shape[:2], bool)
    for layer_dx, layer_dy in zip(dx, dy, strict=True):
        edge |= cv2.Canny(layer_dx, layer_dy, least / 2, least, L2gradient=True) > 0
    strongest = strength.argmax(axis=0)[None]
    across, down = (np.take_along_axis(part, strongest, 0)[0].astype(float) for part in (dx, dy))
    return edge, (np.arctan2(down, across) + math.pi / 2) % math.pi, strength.max(axis=0)


def outlines(picture: Level, edges: Edges) -> list[Outline]:
    """Upright rectangles that stand below and reach above the horizon, the best supported first."""
    found = [each for wish in _wishes(picture, edges) for each in _closed(picture, edges, *wish)]
    return sorted(found, key=lambda each: each.support, reverse=True)


def direction(edge: Array) -> tuple[float, float]:
    """t and c of a level edge of an upright plane."""
    x1, y1, x2, y2 = edge
    slope = (y2 - y1) / (x2 - x1)
    c = y1 - slope * x1
    return slope / c, c


def _wishes(picture: Level, edges: Edges) -> Iterator[tuple[float, float, float, float]]:
    """Left and right edge of a rectangle, with t and c of one of its level edges."""
    columns, width = edges.columns(), picture.image.shape[1] / picture.focal
    for edge in picture.edges:
        x1, y1, x2, y2 = edge
        if x2 - x1 < THINNEST * width / 2 or abs(y1 - (y2 - y1) / (x2 - x1) * x1) < 0.02:
            continue
        t, c = direction(edge)
        lefts = [x for x in columns if -BESIDE * width < x1 - x < x2 - x1]
        rights = [x for x in columns if -BESIDE * width < x - x2 < x2 - x1]
        for left in lefts:
            for right in rights:
                spanned = (min(x2, right) - max(x1, left)) / max(right - left, 1e-6)
                if right - left >= THINNEST * width and spanned >= SPANNED and 1 + t * left > 0.1 and 1 + t * right > 0.1:
                    yield left, right, t, c


def _closed(picture: Level, edges: Edges, x1: float, x2: float, t: float, c: float) -> Iterator[Outline]:
    """The rectangles with that edge."""
    least = min(1 + t * x1, 1 + t * x2)
    above, below = picture.middle[1] / picture.focal, (edges.size[0] - picture.middle[1]) / picture.focal
    step, near = 1.5 / picture.focal, np.array([c])
    tops = near if c < 0 else -np.arange(0.03, above / least, step)
    bottoms = near if c > 0 else np.arange(0.03, below / least, step)
    top_seen, bottom_seen = edges.level(x1, x2, t, tops), edges.level(x1, x2, t, bottoms)
    choices: list[tuple[float | None, float]] = [(float(tops[i]), float(top_seen[i])) for i in _best(top_seen)]
    if c > 0:
        choices.append((None, 0.6))
    for top, top_share in choices:
        for i in _best(bottom_seen):
            yield from _judged(picture, edges, (x1, x2, t), (top, top_share), (float(bottoms[i]), float(bottom_seen[i])))


def _best(shares: Array, most: int = 4) -> list[int]:
    """The places of the greatest local maxima."""
    values = np.nan_to_num(shares)
    around = np.concatenate([[0.0], values, [0.0]])
    peak = (values >= around[:-2]) & (values >= around[2:]) & (values > 0.4)
    places = np.nonzero(peak)[0]
    return [int(i) for i in places[np.argsort(values[places])[::-1][:most]]]


def _judged(
    picture: Level,
    edges: Edges,
    sides: tuple[float, float, float],
    top: tuple[float | None, float],
    bottom: tuple[float, float],
) -> Iterator[Outline]:
    x1, x2, t = sides
    shares = [top[1], bottom[1]]
    for x in (x1, x2):
        scale = 1 + t * x
        end = bottom[0] * scale
        begin = -picture.middle[1] / picture.focal if top[0] is None else top[0] * scale
        seen = edges.upright(x, begin, end)
        if seen is None:
            return
        beyond = edges.upright(x, end + 3 / picture.focal, end + (end - begin) * TOO_FAR)
        shares.append(seen * (1 - 0.8 * (beyond or 0.0)))
    if min(shares) < LEAST:
        return
    yield Outline(x1, x2, t, top[0], bottom[0], math.prod(shares) ** 0.25, min(shares))


def fitted(picture: Level, outline: Outline) -> Outline:
    """The outline with t, top and bottom as the edges along it have them, by least squares."""
    near = (NEAR + 1) / picture.focal
    t, ends = outline.t, [c for c in (outline.top, outline.bottom) if c is not None]
    for _ in range(FITS):
        rows, values, weights = [], [], []
        for number, c in enumerate(ends):
            for x1, y1, x2, y2 in picture.edges:
                if x1 < outline.x1 - near or x2 > outline.x2 + near:
                    continue
                beside = [(x, y - c * (1 + t * x)) for x, y in ((x1, y1), (x2, y2))]
                if any(abs(off) > near for _, off in beside):
                    continue
                for x, off in beside:
                    rows.append([c * x, *(1 + t * x if number == each else 0.0 for each in range(len(ends)))])
                    values.append(off)
                    weights.append(x2 - x1)
        if len(rows) < 2 * len(ends):
            return outline
        share = np.array(weights)
        change = np.linalg.lstsq(np.array(rows) * share[:, None], np.array(values) * share, rcond=1e-9)[0]
        t, ends = t + float(change[0]), [c + float(more) for c, more in zip(ends, change[1:], strict=True)]
    return replace(outline, t=t, top=None if outline.top is None else ends[0], bottom=ends[-1])
