"""The room as package.json describes it, in the map: m, rad. Where there is space to walk, and the ways round an obstacle."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rapp_api import Pose

Point = tuple[float, float]

MARGIN = 0.3  # m that the robot keeps from walls and things
ASIDE = 0.5  # m to the side of what is in the way
BEYOND = 1.0  # m ahead of where the robot was stopped: behind what it saw there
NEAREST = 0.6  # m to a place before which there is no way round: what is in the way is where the robot would stand


@dataclass(frozen=True)
class Thing:
    """Something that stands in the room."""

    name: str
    middle: Point
    size: Point

    def distance(self, point: Point) -> float:
        """From a point, 0 within."""
        beside = [max(0.0, abs(point[i] - self.middle[i]) - self.size[i] / 2) for i in (0, 1)]
        return math.hypot(*beside)


@dataclass(frozen=True)
class Place:
    """Where to stand, and at which point to look from there."""

    name: str
    stand: Point
    look: tuple[float, float, float]


class Room:
    """Outline, things and places, and the pose in which the robot is switched on."""

    def __init__(self, parameters: dict[str, Any]) -> None:
        self.home = Pose(*parameters["home"])
        self.outline: list[Point] = [(x, y) for x, y in parameters["outline"]]
        self.things = [Thing(thing["name"], tuple(thing["middle"]), tuple(thing["size"])) for thing in parameters["things"]]
        self.places = [Place(place["name"], tuple(place["stand"]), tuple(place["look"])) for place in parameters["places"]]

    def space(self, point: Point) -> float:
        """Distance to the nearest wall or thing; 0 outside of the room."""
        walls = list(zip(self.outline, [*self.outline[1:], self.outline[0]], strict=True))
        if not _within(point, walls):
            return 0.0
        return min([_to_line(point, *wall) for wall in walls] + [thing.distance(point) for thing in self.things])

    def ways_round(self, here: Point, goal: Point) -> list[list[Point]]:
        """Ways past something close ahead on the straight way to a goal, the roomier one first."""
        left = math.dist(here, goal)
        if left < NEAREST:
            return []
        ahead = ((goal[0] - here[0]) / left, (goal[1] - here[1]) / left)
        ways = []
        for side in (1, -1):
            beside = _moved(here, (-ahead[1], ahead[0]), side * ASIDE)
            way = [beside, _moved(beside, ahead, min(left, BEYOND))]
            ways.append((min(self.space(point) for point in way), [*way, goal]))
        ways.sort(key=lambda way: way[0], reverse=True)
        return [way for space, way in ways if space >= MARGIN]


def along(start: Point, points: Sequence[Point]) -> list[Pose]:
    """Poses of a way: at each point the robot looks where it has walked to."""
    poses = []
    for before, point in zip([start, *points], points, strict=False):
        poses.append(Pose(*point, math.atan2(point[1] - before[1], point[0] - before[0])))
    return poses


def seen_from(pose: Pose, point: tuple[float, float, float]) -> tuple[float, float, float]:
    """A point of the map in the frame of a robot at a pose; the height stays."""
    x, y = point[0] - pose.x, point[1] - pose.y
    cos, sin = math.cos(pose.theta), math.sin(pose.theta)
    return (cos * x + sin * y, cos * y - sin * x, point[2])


def _moved(point: Point, direction: Point, distance: float) -> Point:
    return (point[0] + distance * direction[0], point[1] + distance * direction[1])


def _within(point: Point, walls: Sequence[tuple[Point, Point]]) -> bool:
    """Whether a ray to the right of a point meets an odd number of walls."""
    x, y = point
    met = [(x1, y1, x2, y2) for (x1, y1), (x2, y2) in walls if (y1 > y) != (y2 > y)]
    return sum(x < x1 + (y - y1) / (y2 - y1) * (x2 - x1) for x1, y1, x2, y2 in met) % 2 == 1


def _to_line(point: Point, start: Point, end: Point) -> float:
    length = math.dist(start, end)
    along_line = sum((point[i] - start[i]) * (end[i] - start[i]) for i in (0, 1)) / length**2
    share = min(1.0, max(0.0, along_line))
    return math.dist(point, (start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])))
