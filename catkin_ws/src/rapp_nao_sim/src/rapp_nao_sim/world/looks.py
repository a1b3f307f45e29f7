"""How the NAO looks: rounded shells drawn around the model's links, and their meshes as Wavefront OBJ text."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from rapp_nao_sim.world.model import Vector, mirrored

COLOURS = {
    "white": (0.95, 0.95, 0.96),
    "shade": (0.80, 0.81, 0.84),
    "grey": (0.33, 0.34, 0.38),
    "dark": (0.10, 0.10, 0.12),
    "orange": (0.95, 0.42, 0.06),
    "blue": (0.30, 0.78, 0.98),
}
_FACES = (28, 16)  # of a shell: around, along
_OWN_FACES = (12, 6)  # as the robot's cameras see it, which draw them all for each picture


@dataclass(frozen=True)
class Look:
    """A shell in a link's frame: a superellipsoid with half axes `half`.

    `round` 1 is an ellipsoid, smaller is nearer to a box; `taper` is the width at the bottom relative to that at the top.
    """

    half: Vector
    centre: Vector
    colour: str
    round: float = 0.45
    taper: float = 1.0
    pitch: float = 0.0  # rad, about y


_CENTRAL = {
    "torso": [
        Look((0.058, 0.078, 0.088), (0.0, 0.0, 0.045), "white", 0.5, 0.74),
        Look((0.046, 0.050, 0.040), (-0.004, 0.0, -0.055), "grey", 0.5),
        Look((0.012, 0.046, 0.030), (0.050, 0.0, 0.075), "orange", 0.5, 0.8),
        Look((0.006, 0.010, 0.010), (0.058, 0.0, 0.030), "shade", 1.0),
        Look((0.022, 0.052, 0.058), (-0.050, 0.0, 0.060), "shade", 0.5, 0.8),
    ],
    "Neck": [Look((0.026, 0.026, 0.03), (0, 0, -0.012), "grey", 0.6)],
    "Head": [
        Look((0.062, 0.066, 0.056), (0.0, 0.0, 0.066), "white", 0.82),
        Look((0.050, 0.046, 0.034), (0.010, 0.0, 0.026), "white", 0.7),
        Look((0.034, 0.028, 0.006), (-0.004, 0.0, 0.120), "shade", 0.8),
        Look((0.007, 0.007, 0.007), (0.0585, 0.0, 0.086), "dark", 1.0),
        Look((0.006, 0.011, 0.006), (0.0580, 0.0, 0.018), "dark", 0.8),
    ],
}
_EYES = [
    Look((0.007, 0.0165, 0.0165), (0.0535, 0.026, 0.061), "dark", 1.0),
    Look((0.0055, 0.0105, 0.0105), (0.0575, 0.0262, 0.061), "blue", 1.0),
    Look((0.0045, 0.0055, 0.0055), (0.0605, 0.0264, 0.061), "dark", 1.0),
    Look((0.028, 0.010, 0.028), (-0.006, 0.064, 0.058), "orange", 0.6),
    Look((0.016, 0.006, 0.016), (-0.006, 0.072, 0.058), "shade", 0.7),
]
_LEFT = {
    "Shoulder": [Look((0.034, 0.026, 0.034), (0, -0.012, 0), "grey", 0.9)],
    "Bicep": [
        Look((0.036, 0.034, 0.036), (0.004, 0.004, 0), "orange", 0.8),
        Look((0.050, 0.026, 0.028), (0.056, 0.010, 0), "white", 0.55),
    ],
    "Elbow": [Look((0.024, 0.024, 0.024), (0, 0, 0), "grey", 0.9)],
    "ForeArm": [Look((0.036, 0.027, 0.028), (0.034, 0.0, 0.0), "white", 0.6)],
    "Wrist": [
        Look((0.010, 0.025, 0.025), (0.012, 0.0, 0.0), "orange", 0.6),
        Look((0.026, 0.023, 0.019), (0.038, 0.0, 0.0), "shade", 0.6),
    ],
    "Fingers": [Look((0.020, 0.006, 0.007), (0.016, y, -0.004), "grey", 0.7, pitch=0.5) for y in (-0.015, 0.0, 0.015)],
    "Hip": [Look((0.034, 0.034, 0.034), (-0.004, 0.0, 0.0), "grey", 0.8)],
    "Thigh": [
        Look((0.038, 0.037, 0.056), (0.004, 0.004, -0.046), "white", 0.5, 0.82),
        Look((0.010, 0.020, 0.030), (0.036, 0.004, -0.040), "orange", 0.5, 0.8),
    ],
    "Tibia": [
        Look((0.027, 0.030, 0.027), (0, 0, 0), "grey", 0.8),
        Look((0.035, 0.033, 0.046), (0.006, 0.003, -0.060), "white", 0.5, 0.84),
    ],
    "AnklePitch": [Look((0.026, 0.028, 0.024), (0, 0, 0), "grey", 0.8)],
    "Ankle": [
        Look((0.079, 0.044, 0.024), (0.025, 0.0035, -0.020), "white", 0.5, 1.15),
        Look((0.022, 0.034, 0.012), (0.072, 0.0035, -0.020), "orange", 0.5, 1.1),
        Look((0.080, 0.046, 0.006), (0.025, 0.0035, -0.039), "grey", 0.3),
    ],
}


def shells(own_view: bool = False) -> Iterator[tuple[str, Look, str]]:
    """Every shell: the name of its link, its look, its mesh. In the robot's own view it has no head, which holds its cameras."""
    for link, look in looks():
        if not own_view:
            yield link, look, mesh(look)
        elif link not in ("Head", "Neck"):
            yield link, look, mesh(look, _OWN_FACES)


def looks() -> Iterator[tuple[str, Look]]:
    """Every look with the name of its link."""
    for link, shells in _CENTRAL.items():
        for shell in shells:
            yield link, shell
    for shell in _EYES:
        yield "Head", shell
        yield "Head", replace(shell, centre=mirrored(shell.centre))
    for link, shells in _LEFT.items():
        for shell in shells:
            yield "L" + link, shell
            yield "R" + link, replace(shell, centre=mirrored(shell.centre))


def _power(value: float, exponent: float) -> float:
    return math.copysign(abs(value) ** exponent, value)


def mesh(look: Look, faces_of: tuple[int, int] = _FACES) -> str:
    """The shell about its centre as Wavefront OBJ text, with normals, so that it is shaded smoothly."""
    around, along = faces_of
    vertices, normals, faces = [], [], []
    a, b, c = look.half
    for i in range(along + 1):
        latitude = -math.pi / 2 + math.pi * i / along
        for j in range(around):
            longitude = 2 * math.pi * j / around
            ring, up = _power(math.cos(latitude), look.round), _power(math.sin(latitude), look.round)
            x, y = ring * _power(math.cos(longitude), look.round), ring * _power(math.sin(longitude), look.round)
            width = look.taper + (1 - look.taper) * (up + 1) / 2
            vertices.append((a * x * width, b * y * width, c * up))
            ring, up = _power(math.cos(latitude), 2 - look.round), _power(math.sin(latitude), 2 - look.round)
            normal = (
                ring * _power(math.cos(longitude), 2 - look.round) / a,
                ring * _power(math.sin(longitude), 2 - look.round) / b,
                up / c,
            )
            length = math.hypot(*normal)
            normals.append(tuple(part / length for part in normal))
    for i in range(along):
        for j in range(around):
            low, high = i * around + j + 1, i * around + (j + 1) % around + 1
            faces.append((low, high, high + around))
            faces.append((low, high + around, low + around))
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    lines += [f"vn {x:.5f} {y:.5f} {z:.5f}" for x, y, z in normals]
    lines += ["f " + " ".join(f"{k}//{k}" for k in face) for face in faces]
    return "\n".join(lines) + "\n"
