"""Pictures of a door, a lamp and codes, drawn with lines and areas by a pinhole of our own: no simulator's room."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Colour = tuple[int, int, int]
Point = tuple[float, float, float]
FIELD_OF_VIEW = math.radians(60.97)
FINER = 4  # times: smooth edges


@dataclass(frozen=True)
class DoorScene:
    """A door 0.9 m broad in a wall that faces the camera but for `wall`; m, degrees, blue-green-red."""

    angle: float = 0.0
    inwards: bool = True
    hinge_left: bool = True
    aside: float = -0.6  # m of the camera to the right of the hinge
    away: float = 2.9  # m from the wall
    eye: float = 0.9  # m above the floor
    up: float = 3.0  # degrees the camera looks up
    turn: float = 12.0  # degrees it looks to the right
    wall: Colour = (190, 205, 210)
    leaf: Colour = (60, 90, 140)
    floor: Colour = (120, 140, 150)
    beyond: Colour = (90, 120, 120)
    noise: float = 0.0
    bright: float = 1.0
    size: tuple[int, int] = (640, 480)


WIDTH, HEIGHT, FRAME = 0.9, 2.05, 0.07  # m
NEXT_ROOM = 1.5  # m that it is deep


def draw_door(scene: DoorScene) -> Image:
    """What its camera sees."""
    sheet = _Sheet(scene)
    side = 1 if scene.hinge_left else -1
    sheet.area([(-9, 0, 0), (9, 0, 0), (9, 0, 2.7), (-9, 0, 2.7)], scene.wall)
    sheet.area([(-9, -9, 0), (9, -9, 0), (9, 0, 0), (-9, 0, 0)], scene.floor)
    jambs = sorted((0.0, side * WIDTH))
    left, right = jambs[0] - FRAME, jambs[1] + FRAME
    sheet.area([(left, 0, 0), (right, 0, 0), (right, 0, HEIGHT + FRAME), (left, 0, HEIGHT + FRAME)], (225, 228, 230))
    if scene.angle:
        sheet.area([(jambs[0], 0, 0), (jambs[1], 0, 0), (jambs[1], 0, HEIGHT), (jambs[0], 0, HEIGHT)], scene.beyond)
        _floor_beyond(sheet, scene, jambs)
    turn = math.radians(scene.angle)
    along = (side * math.cos(turn), (-1 if scene.inwards else 1) * math.sin(turn))
    x, y = along[0] * WIDTH, along[1] * WIDTH
    sheet.area([(0, 0, 0), (x, y, 0), (x, y, HEIGHT), (0, 0, HEIGHT)], scene.leaf)
    return sheet.developed()


def _floor_beyond(sheet: "_Sheet", scene: DoorScene, jambs: Sequence[float]) -> None:
    """The floor of the next room, as far as it is seen through the doorway: its far end is this high in the wall's plane."""
    far = scene.eye * NEXT_ROOM / (NEXT_ROOM + scene.away)
    sheet.area([(jambs[0], 0, 0), (jambs[1], 0, 0), (jambs[1], 0, far), (jambs[0], 0, far)], scene.floor)


class _Sheet:
    def __init__(self, scene: DoorScene) -> None:
        self._scene = scene
        width, height = scene.size
        self._image = np.full((height * FINER, width * FINER, 3), 235, np.uint8)
        self._focal = width / 2 / math.tan(FIELD_OF_VIEW / 2)

    def area(self, corners: Sequence[Point], colour: Colour) -> None:
        """Fill a polygon of the room: x to the right of the hinge, y behind the wall, z up."""
        points = _before([self._seen(corner) for corner in corners])
        width, height = self._scene.size
        pixels = [(width / 2 + self._focal * x / z, height / 2 + self._focal * y / z) for x, y, z in points]
        cv2.fillPoly(self._image, [np.rint(np.array(pixels) * FINER).astype(np.int32)], colour)

    def _seen(self, point: Point) -> Point:
        """To the right, down, ahead of the camera."""
        scene = self._scene
        x, y, z = point[0] - scene.aside, point[1] + scene.away, point[2] - scene.eye
        turn, up = math.radians(scene.turn), math.radians(scene.up)
        right, ahead = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
        return right, -(z * math.cos(up) - ahead * math.sin(up)), ahead * math.cos(up) + z * math.sin(up)

    def developed(self) -> Image:
        """As large as wanted, with the camera's noise."""
        scene = self._scene
        small = cv2.resize(self._image, scene.size, interpolation=cv2.INTER_AREA).astype(float) * scene.bright
        small += np.random.default_rng(3).normal(0, 1, small.shape) * scene.noise
        return np.clip(small, 0, 255).astype(np.uint8)


def _before(points: Sequence[Point], near: float = 0.05) -> list[Point]:
    """The part of a polygon that is before the camera."""
    kept: list[Point] = []
    for one, other in zip(points, [*points[1:], points[0]], strict=True):
        if one[2] >= near:
            kept.append(one)
        if (one[2] >= near) != (other[2] >= near):
            share = (near - one[2]) / (other[2] - one[2])
            kept.append((one[0] + share * (other[0] - one[0]), one[1] + share * (other[1] - one[1]), near))
    return kept


def draw_lamp(shade: Colour, wall: Colour, radius: float = 0.09, middle: tuple[float, float] = (0.5, 0.5)) -> Image:
    """A round lamp on a stand before a wall; radius and middle in shares of the picture's width and height."""
    image = np.full((480, 640, 3), wall, np.uint8)
    x, y, size = round(640 * middle[0]), round(480 * middle[1]), round(640 * radius)
    cv2.rectangle(image, (x - 5, y), (x + 5, 479), (60, 55, 55), -1)
    cv2.ellipse(image, (x, y), (size, round(size * 0.8)), 0, 0, 360, shade, -1, cv2.LINE_AA)
    return cv2.GaussianBlur(image, (3, 3), 0).astype(np.uint8)


def draw_codes(*codes: tuple[str, int, int, int], size: tuple[int, int] = (640, 480)) -> Image:
    """QR codes, each with its text, the middle's column and row, and its side in pixels, on a grey wall."""
    image = np.full((size[1], size[0], 3), 150, np.uint8)
    for text, x, y, side in codes:
        code = cv2.QRCodeEncoder.create().encode(text)
        code = cv2.resize(code, (side, side), interpolation=cv2.INTER_NEAREST)
        left, top = x - side // 2, y - side // 2
        image[top : top + side, left : left + side] = code[..., None]
    return image
