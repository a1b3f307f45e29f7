"""How far a door stands open, from one picture of it (the original platform's hazard_detection_door_check).

The leaf of a door is an upright rectangle; its top and bottom edge tell which way it faces, as the level edges round about tell of
the wall. The door's angle is that between the two.
"""

import math
from dataclasses import dataclass

import numpy as np

from rapp_cloud.vision.level import Image, Level, level
from rapp_cloud.vision.outlines import Edges, Outline, fitted, outlines
from rapp_cloud.vision.walls import ALIKE, Wall, wall_round

FIELD_OF_VIEW = math.radians(60.97)  # of a NAO's cameras, from left to right
SHAPES = (0.3, 0.75)  # width of a door's leaf, in heights
HALF_SHAPES = (0.6, 2.2)  # its width in heights of the camera, when its top is not in the picture
EYE = (0.12, 0.75)  # height of the camera above the floor, in heights of the leaf: it looks from below the top
SMALLEST = 0.4  # of the picture's height, that a leaf is high at least
SURE = 0.55  # confidence from which the answer counts
CLOSED = math.radians(5.0)  # up to which a door counts as closed
MOST = 60  # rectangles that are looked at
BESIDE_FOOT = 0.015  # of its distance below the horizon that a hinge stands beside the wall's foot
WHOLE = 0.45  # share of each edge of a closed leaf: pieces of a wall have such edges only in part
AS_CLEAR = 0.6  # share of the wall's strength
UNKNOWN_FOOT = 0.8  # for a wall whose foot is not seen


@dataclass(frozen=True)
class Door:
    """What was seen: rad from 0 (closed) to pi / 2, and how sure that is, 0 to 1; angle None: no door was seen."""

    angle: float | None
    confidence: float

    @property
    def sure(self) -> bool:
        """Whether the angle is to be relied on."""
        return self.angle is not None and self.confidence >= SURE


def look_at_door(image: Image, field_of_view: float = FIELD_OF_VIEW) -> Door:
    """Find a door's leaf and the wall that it is hung in."""
    picture = level(image, field_of_view)
    if picture is None:
        return Door(None, 0.0)
    edges = Edges(picture)
    found = [leaf for leaf in outlines(picture, edges) if _like_a_door(leaf, picture)][:MOST]
    walls = [(leaf, wall) for leaf in found if (wall := wall_round(picture, edges, leaf))]
    hung = [(leaf, wall, _rank(leaf) * _hinged(leaf, wall, picture) * _solid(leaf, wall, edges)) for leaf, wall in walls]
    if not hung:
        return Door(None, 0.0)
    hung.sort(key=lambda each: each[2], reverse=True)
    leaf, wall, rank = hung[0]
    leaf = fitted(picture, leaf)
    angle = _between(math.atan(leaf.t), wall.direction)
    rival = max((r for other, w, r in hung if abs(_between(math.atan(other.t), w.direction) - angle) > 2 * ALIKE), default=0.0)
    margin = 1 - rival / rank if rank else 0.0
    return Door(angle, float(rank / _rank(leaf) * leaf.support * wall.agreed * min(1.0, 0.4 + 4 * margin)))


def _like_a_door(leaf: Outline, picture: Level) -> bool:
    if leaf.height is None:
        return HALF_SHAPES[0] <= leaf.width / leaf.bottom <= HALF_SHAPES[1]
    shaped = SHAPES[0] <= leaf.width / leaf.height <= SHAPES[1] and EYE[0] <= leaf.bottom / leaf.height <= EYE[1]
    return shaped and leaf.height * (1 + leaf.t * (leaf.x1 + leaf.x2) / 2) * picture.focal >= SMALLEST * picture.height


def _rank(leaf: Outline) -> float:
    """Of two rectangles in one another, such as a leaf and its panels, the larger one is the door."""
    reach = leaf.bottom * 2 if leaf.top is None else leaf.bottom - leaf.top
    return float(leaf.support * (reach * (1 + leaf.t * (leaf.x1 + leaf.x2) / 2)) ** 0.2)


def _hinged(leaf: Outline, wall: Wall, picture: Level) -> float:
    """Whether one end of the leaf stands at the wall's foot, 1 or less: a doorway through which one sees another room does not."""
    if wall.foot is None:
        return UNKNOWN_FOOT
    ends = [(leaf.bottom * (1 + leaf.t * x), wall.foot * (1 + math.tan(wall.direction) * x)) for x in (leaf.x1, leaf.x2)]
    away = min(abs(stands - foot) for stands, foot in ends)
    tolerance = BESIDE_FOOT * max(foot for _, foot in ends) + 1.5 / picture.focal
    return float(math.exp(-((away / tolerance) ** 2) / 2))


def _solid(leaf: Outline, wall: Wall, edges: Edges) -> float:
    """Whether what lies in the wall's plane is a leaf, and ends at the floor as clearly as the wall; a seam is fainter."""
    if wall.foot is None or _between(math.atan(leaf.t), wall.direction) > CLOSED:
        return 1.0
    if leaf.weakest < WHOLE:
        return 0.0
    (bottom,) = edges.strength(leaf.x1, leaf.x2, leaf.t, np.array([leaf.bottom]))
    return float(min(1.0, bottom / wall.strength / AS_CLEAR))


def _between(one: float, other: float) -> float:
    """Angle between two directions that planes face, 0 to pi / 2."""
    return abs((one - other + math.pi / 2) % math.pi - math.pi / 2)
