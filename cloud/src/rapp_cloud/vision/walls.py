"""The wall round an outline in a levelled picture: which way it faces, and where its foot is."""

import math
from dataclasses import dataclass

import numpy as np

from rapp_cloud.vision.level import Array, Level
from rapp_cloud.vision.outlines import Edges, Outline, direction

ALIKE = math.radians(3.0)  # between directions that are the same
KERNEL = math.radians(1.5)  # of the vote
FADES = 0.3  # focal lengths from the outline at which an edge counts 1 / e
ASIDE = 0.2  # focal lengths to the side of the outline where the wall's foot is looked for
FOLLOWED = 0.6  # of the strongest edge there: the seams of a floor are weaker
SHORTEST = 8  # pixels of an edge that votes


@dataclass(frozen=True)
class Wall:
    """The direction it faces, rad; its foot is the line y = foot (1 + t x) with t the tangent of that; how many edges agree."""

    direction: float
    foot: float | None
    strength: float  # of the edge that is its foot
    agreed: float  # 0 to 1


def wall_round(picture: Level, seen: Edges, leaf: Outline) -> Wall | None:
    """The wall that most of the level edges round an outline belong to, the long and near ones before others."""
    edges = np.array([edge for edge in picture.edges if _of_the_wall(edge, leaf, picture)])
    if not len(edges):
        return None
    angles, weights = np.array([_vote(edge, leaf, picture) for edge in edges]).T
    grid = np.radians(np.arange(-85.0, 85.5, 0.5))
    tally = (np.exp(-(((grid[:, None] - angles[None]) / KERNEL) ** 2) / 2) * weights).sum(axis=1)
    near = np.abs(angles - grid[tally.argmax()]) < ALIKE
    agreed = float(weights[near].sum() / weights.sum())
    faces = float(np.average(angles[near], weights=weights[near]))
    return Wall(faces, *_foot(seen, edges, leaf, math.tan(faces), 1 / picture.focal), agreed)


def _of_the_wall(edge: Array, leaf: Outline, picture: Level) -> bool:
    """Whether an edge is neither inside of the outline nor on the floor before it."""
    x1, y1, x2, y2 = edge
    if x2 - x1 < SHORTEST / picture.focal or abs(y2 - y1) > 2 * (x2 - x1):
        return False
    x, y = (x1 + x2) / 2, (y1 + y2) / 2
    if leaf.x1 < x < leaf.x2 and (leaf.top is None or y > 1.01 * leaf.top * (1 + leaf.t * x)):
        return False
    return bool(y < 1.02 * leaf.bottom * max(1 + leaf.t * leaf.x1, 1 + leaf.t * leaf.x2))


def _vote(edge: Array, leaf: Outline, picture: Level) -> tuple[float, float]:
    """Direction and weight."""
    run = edge[2] - edge[0]
    t, c = direction(edge)
    away = max(0.0, leaf.x1 - edge[2], edge[0] - leaf.x2)
    unsure = 1 / picture.focal / run / abs(c)  # in t, when one end is a pixel off
    return math.atan(t), run * math.exp(-away / FADES) / (1 + (unsure / math.tan(KERNEL)) ** 2)


def _foot(edges: Edges, candidates: Array, leaf: Outline, t: float, pixel: float) -> tuple[float | None, float]:
    """The lowest of the strong edges that face so and can be followed along the wall on either side, and its strength."""
    ends = np.stack([candidates[:, 1] / (1 + t * candidates[:, 0]), candidates[:, 3] / (1 + t * candidates[:, 2])])
    level = (ends.min(axis=0) > 0.02) & (np.abs(ends[0] - ends[1]) < 3 * pixel)
    feet = np.unique(ends.mean(axis=0)[level])
    if not len(feet):
        return None, 0.0
    sides = [edges.strength(x1, x2, t, feet) for x1, x2 in ((leaf.x1 - ASIDE, leaf.x1), (leaf.x2, leaf.x2 + ASIDE))]
    strength = np.stack(sides).max(axis=0)
    if not strength.max() > 0:
        return None, 0.0
    lowest = int(np.nonzero(strength >= FOLLOWED * strength.max())[0].max())
    return float(feet[lowest]), float(strength[lowest])
