"""The predefined postures, from a file: joint values, family, and how the torso leans in them."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rapp_nao_sim.world.errors import Invalid
from rapp_nao_sim.world.model import BODY, JOINTS

FILE = Path(__file__).with_name("postures.toml")
FAMILIES = ("Standing", "Sitting", "LyingBelly", "LyingBack", "LyingLeft", "LyingRight", "Unknown")
TOLERANCE = 0.2  # rad: a joint farther away than this is not in the posture
LEAN_TOLERANCE = 0.35  # rad, of the torso


@dataclass(frozen=True)
class Posture:
    """A posture the robot can rest in."""

    name: str
    family: str  # one of FAMILIES
    pitch: float  # rad, of the torso, forward positive
    angles: Mapping[str, float]  # rad for each joint of the body


def load(path: Path = FILE) -> dict[str, Posture]:
    """Read postures; raises Invalid when a joint is missing, unknown or beyond its range."""
    try:
        tables = tomllib.loads(path.read_text())
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise Invalid(f"cannot read postures from {path}: {error}; correct the file") from error
    return {name: _posture(name, table) for name, table in tables.items()}


def _posture(name: str, table: object) -> Posture:
    match table:
        case {"family": str(family), "pitch": int() | float() as pitch, "angles": dict(angles)} if family in FAMILIES:
            pass
        case _:
            raise Invalid(f"cannot use posture {name}: it needs a family of {FAMILIES}, a pitch and angles; correct the file")
    if set(angles) != set(BODY):
        wrong = ", ".join(sorted(set(angles) ^ set(BODY)))
        raise Invalid(f"cannot use posture {name}: missing or unknown joints: {wrong}; correct the file")
    for joint, angle in angles.items():
        limits = JOINTS[joint]
        if not isinstance(angle, int | float) or not limits.lower - 1e-3 <= angle <= limits.upper + 1e-3:
            raise Invalid(f"cannot use posture {name}: {joint} = {angle} is beyond its range; correct the file")
    return Posture(name, family, float(pitch), {joint: float(angles[joint]) for joint in BODY})


def recognise(postures: Mapping[str, Posture], angles: Mapping[str, float], pitch: float, roll: float) -> str:
    """The name of the posture the body is in (the head and the hands are free), else "Unknown"; pitch and roll in rad."""
    best, name = TOLERANCE, "Unknown"
    for posture in postures.values():
        if max(abs(pitch - posture.pitch), abs(roll)) > LEAN_TOLERANCE:
            continue
        wrong = max(
            abs(angles[joint] - posture.angles[joint]) for joint in BODY if not joint.startswith("Head") and "Hand" not in joint
        )
        if wrong < best:
            best, name = wrong, posture.name
    return name


def family(pitch: float, roll: float, hips: float) -> str:
    """The family a body is in by its lean (rad) and the height of its hips above the floor (m)."""
    if roll > 0.8:
        return "LyingRight"
    if roll < -0.8:
        return "LyingLeft"
    if pitch > 0.8:
        return "LyingBelly"
    if pitch < -0.8:
        return "LyingBack"
    return "Standing" if hips > 0.13 else "Sitting"
