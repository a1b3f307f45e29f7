"""The pictures that hang in the room or cover its floor, painted by ourselves; uint8 arrays in blue, green, red."""

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
_Grid = npt.NDArray[np.float64]
_SIDE = 512  # pixels


def paint(kind: str, text: str = "") -> Image:
    """The picture of a kind named in the room file."""
    match kind:
        case "qr":
            return _qr(text)
        case "face":
            return _bytes(_framed(_portrait((0.55, 0.50, 0.42)), 18, (0.18, 0.24, 0.30)))
        case "head":
            return _bytes(_portrait((0.10, 0.12, 0.16)))
        case "landscape":
            return _landscape()
        case _:
            return _planks()


def _qr(text: str) -> Image:
    code = cv2.QRCodeEncoder.create().encode(text)
    code = cv2.copyMakeBorder(code, 2, 2, 2, 2, cv2.BORDER_CONSTANT, value=(255.0,))
    code = cv2.resize(code, (_SIDE, _SIDE), interpolation=cv2.INTER_NEAREST)
    return np.asarray(cv2.cvtColor(code, cv2.COLOR_GRAY2BGR), np.uint8)


def _bump(u: _Grid, v: _Grid, x: float, y: float, width: float, height: float) -> _Grid:
    return np.exp(-(((u - x) / width) ** 2) - ((v - y) / height) ** 2)


def _inside(u: _Grid, v: _Grid, y: float, width: float, height: float) -> _Grid:
    """Share of an ellipse with a soft edge at each point."""
    return 1 / (1 + np.exp(((u / width) ** 2 + ((v - y) / height) ** 2 - 1) * 14))


def _portrait(behind: tuple[float, float, float]) -> npt.NDArray[Any]:
    """A shaded face with the dark eyes, bright cheeks and nose that face detectors look for; nobody's."""
    v, u = np.mgrid[0:_SIDE, 0:_SIDE].astype(float)
    u, v = (u - _SIDE / 2) / (_SIDE / 2), (v - _SIDE * 0.52) / (_SIDE / 2)
    light = 0.78 + 0.12 * _bump(u, v, 0, -0.45, 0.4, 0.18) + 0.14 * _bump(u, v, 0, 0.05, 0.07, 0.28)
    for side in (-1, 1):
        eye = side * 0.25
        light += 0.10 * _bump(u, v, side * 0.28, 0.22, 0.22, 0.22) - 0.28 * _bump(u, v, eye, -0.12, 0.17, 0.10)
        light -= 0.30 * _bump(u, v, eye, -0.27, 0.19, 0.04) + 0.45 * _bump(u, v, eye, -0.11, 0.045, 0.045)
        light += 0.22 * (_bump(u, v, eye - 0.06, -0.11, 0.04, 0.03) + _bump(u, v, eye + 0.06, -0.11, 0.04, 0.03))
        light -= 0.16 * _bump(u, v, side * 0.08, 0.27, 0.05, 0.03)
    light -= 0.10 * _bump(u, v, 0, 0.30, 0.12, 0.03) + 0.30 * _bump(u, v, 0, 0.48, 0.20, 0.045)
    light -= 0.08 * _bump(u, v, 0, 0.58, 0.2, 0.05) + 0.25 * np.clip((np.abs(u) - 0.42) / 0.3, 0, 1)
    head = _inside(u, v, 0, 0.58, 0.78)
    hair = _inside(u, v, -0.12, 0.64, 0.82) * (v < -0.38 + 0.25 * u * u)
    skin = np.clip(light, 0, 1)[..., None] * np.array([0.659, 0.813, 0.988])
    image = np.full((_SIDE, _SIDE, 3), behind)
    for share, colour in (
        (_inside(u, v, 1.05, 0.75, 0.4), (0.35, 0.20, 0.15)),
        (hair, (0.10, 0.12, 0.16)),
        (head * (1 - hair), skin),
    ):
        image += share[..., None] * (np.asarray(colour) - image)
    return image


def _landscape() -> Image:
    """Hills under an evening sky."""
    v, u = np.mgrid[0:_SIDE, 0:_SIDE] / _SIDE
    image = np.array([0.86, 0.72, 0.50]) + v[..., None] * np.array([-0.36, 0.10, 0.50])
    image += _bump(u, v, 0.68, 0.42, 0.10, 0.13)[..., None] * np.array([0.25, 0.25, 0.2])
    for base, height, waves, colour in (
        (0.52, 0.07, 5.0, (0.55, 0.48, 0.40)),
        (0.64, 0.06, 8.0, (0.42, 0.50, 0.30)),
        (0.78, 0.05, 6.5, (0.22, 0.38, 0.20)),
    ):
        hill = v > base + height * np.sin(waves * u + 9 * base)
        image[hill] = colour
    return _bytes(_framed(np.clip(image, 0, 1), 20, (0.93, 0.95, 0.96)))


def _planks() -> Image:
    """Wooden boards; the picture repeats without a seam along and across."""
    random = np.random.default_rng(4)
    image = np.zeros((_SIDE, _SIDE, 3))
    rows, wood = 8, np.array([0.52, 0.70, 0.84])
    x = np.arange(_SIDE) / _SIDE
    tall = _SIDE // rows
    for row in range(rows):
        cut = random.random()
        for half in range(2):
            board = ((x - cut - half / 2) % 1.0) < 0.5
            grain = np.zeros(_SIDE)
            for wave in range(1, 9):
                grain += np.sin(2 * np.pi * (wave * x + random.random())) * random.normal(0, 0.006)
            across = np.cumsum(random.normal(0, 0.008, tall))
            across -= np.linspace(0, across[-1], tall)
            tone = 1 + random.normal(0, 0.045) + grain[None, :] + across[:, None]
            rectangle = image[row * tall : (row + 1) * tall]
            rectangle[:, board] = (tone[..., None] * wood)[:, board]
        image[row * tall : row * tall + 2] *= 0.78
        for half in range(2):
            image[row * tall : (row + 1) * tall, int(((cut + half / 2) % 1.0) * (_SIDE - 2))] *= 0.78
    return _bytes(image)


def _framed(image: npt.NDArray[Any], width: int, colour: tuple[float, float, float]) -> npt.NDArray[Any]:
    for edge in (np.s_[:width], np.s_[-width:], np.s_[:, :width], np.s_[:, -width:]):
        image[edge] = colour
    return image


def _bytes(image: npt.NDArray[Any]) -> Image:
    result: Image = np.clip(image * 255, 0, 255).astype(np.uint8)
    return result
