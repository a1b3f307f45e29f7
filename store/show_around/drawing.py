"""A top view of the room with the path walked in it."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from room import Place, Point, Room

from rapp_api import Pose

SCALE = 180  # pixels of a metre
BORDER = 40  # pixels
PAPER, FLOOR, WALL = (255, 255, 255), (225, 240, 246), (90, 90, 90)  # BGR
THING, PATH, PLACE, START, STOP = (150, 185, 210), (190, 90, 20), (40, 130, 40), (0, 0, 0), (40, 40, 210)
FONT = cv2.FONT_HERSHEY_SIMPLEX


class _Sheet:
    def __init__(self, outline: Sequence[Point]) -> None:
        xs, ys = [x for x, _ in outline], [y for _, y in outline]
        self._left, self._top = min(xs), max(ys)
        width, height = (round((max(values) - min(values)) * SCALE) + 2 * BORDER for values in (xs, ys))
        self.image = np.full((height, width, 3), PAPER, np.uint8)

    def at(self, point: Sequence[float]) -> tuple[int, int]:
        return round((point[0] - self._left) * SCALE) + BORDER, round((self._top - point[1]) * SCALE) + BORDER

    def all(self, points: Sequence[Sequence[float]]) -> NDArray[np.int32]:
        return np.array([self.at(point) for point in points], np.int32).reshape(-1, 1, 2)

    def write(self, text: str, point: Sequence[float], colour: tuple[int, int, int]) -> None:
        x, y = self.at(point)
        cv2.putText(self.image, text, (x + 10, y - 10), FONT, 0.55, colour, 1, cv2.LINE_AA)


def draw(room: Room, path: Sequence[Pose], seen: Sequence[Place], stops: Sequence[Pose]) -> NDArray[np.uint8]:
    """The room, the path, its start, the places that were looked at, and where the robot was stopped."""
    sheet = _Sheet(room.outline)
    cv2.fillPoly(sheet.image, [sheet.all(room.outline)], FLOOR)
    cv2.polylines(sheet.image, [sheet.all(room.outline)], True, WALL, 5, cv2.LINE_AA)
    for thing in room.things:
        (x, y), (width, depth) = thing.middle, thing.size
        cv2.rectangle(sheet.image, sheet.at((x - width / 2, y - depth / 2)), sheet.at((x + width / 2, y + depth / 2)), THING, -1)
        sheet.write(thing.name, (x - width / 2 - 0.05, y - depth / 2 - 0.15), WALL)
    cv2.polylines(sheet.image, [sheet.all([(pose.x, pose.y) for pose in path])], False, PATH, 2, cv2.LINE_AA)
    for pose in path:
        cv2.circle(sheet.image, sheet.at((pose.x, pose.y)), 3, PATH, -1, cv2.LINE_AA)
    for number, place in enumerate(seen, 1):
        cv2.circle(sheet.image, sheet.at(place.stand), 7, PLACE, 2, cv2.LINE_AA)
        sheet.write(f"{number} {place.name}", place.stand, PLACE)
    for pose in stops:
        cv2.drawMarker(sheet.image, sheet.at((pose.x, pose.y)), STOP, cv2.MARKER_TILTED_CROSS, 18, 3, cv2.LINE_AA)
        sheet.write("stopped", (pose.x, pose.y - 0.15), STOP)
    for pose, text in ((path[0], "start"), (path[-1], "end")):
        cv2.circle(sheet.image, sheet.at((pose.x, pose.y)), 5, START, -1, cv2.LINE_AA)
        sheet.write(text, (pose.x, pose.y - (0.25 if text == "start" else 0.35)), START)
    return sheet.image
