"""What the body feels as ALMemory's keys (NAO V5, NAOqi 2.1). Pure.

Angles in rad, lengths in m, weights in kg, temperatures in degrees C, the battery's charge from 0 to 1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from rapp_nao_sim.world.model import BODY

ECHOES = 10  # of a sonar: the first and nine farther ones
CORNERS = ("FrontLeft", "FrontRight", "RearLeft", "RearRight")  # of a foot's pressure sensors
AXES = "XYZ"

# What a hand can press or touch: its name for SimWorld.touch, the sensors' places, and the event.
TOUCHES: dict[str, tuple[tuple[str, ...], str]] = {
    "FrontTactil": (("Head/Touch/Front",), "FrontTactilTouched"),
    "MiddleTactil": (("Head/Touch/Middle",), "MiddleTactilTouched"),
    "RearTactil": (("Head/Touch/Rear",), "RearTactilTouched"),
    "ChestButton": (("ChestBoard/Button",), "ChestButtonPressed"),
    "LeftBumper": (("LFoot/Bumper/Left", "LFoot/Bumper/Right"), "LeftBumperPressed"),
    "RightBumper": (("RFoot/Bumper/Left", "RFoot/Bumper/Right"), "RightBumperPressed"),
}
for _side in ("Left", "Right"):
    for _part in ("Back", "Left", "Right"):
        TOUCHES[f"Hand{_side}{_part}"] = ((f"{_side[0]}Hand/Touch/{_part}",), f"Hand{_side}{_part}Touched")

# What ALMemory holds for the events before their first time.
INITIAL: dict[str, Any] = {
    **{event: 0.0 for _, event in TOUCHES.values()},
    "robotHasFallen": False,
    "robotIsFalling": False,
    "footContactChanged": True,
    "footContact": 1.0,
    "BatteryChargeChanged": 100,
    "SonarLeftDetected": 0.0,
    "SonarRightDetected": 0.0,
    "SonarLeftNothingDetected": 0.0,
    "SonarRightNothingDetected": 0.0,
    "TouchChanged": [],
}


@dataclass(frozen=True)
class Feelings:
    """Everything that the body feels at a moment."""

    angles: Mapping[str, float]
    targets: Mapping[str, float]
    stiffness: Mapping[str, float]
    heat: Mapping[str, float]
    tilt: Sequence[float]  # of the torso about x, y and z
    turning: Sequence[float]  # rad/s about the torso's axes
    pull: Sequence[float]  # m/s² along the torso's axes: gravity less its acceleration
    feet: Mapping[str, Sequence[float]]  # weight on each corner, by side
    pressed: frozenset[str]  # places that are touched or pressed
    charge: float
    echoes: Mapping[str, Sequence[float]] = field(default_factory=dict)  # by "Left" and "Right"


def values(feelings: Feelings) -> dict[str, Any]:
    """The keys and their values."""
    found: dict[str, Any] = {f"Device/SubDeviceList/{name}/Value": value for name, value in _devices(feelings).items()}
    for side, row in feelings.echoes.items():
        for number, distance in enumerate(row):
            found[f"Device/SubDeviceList/US/{side}/Sensor/Value{number or ''}"] = distance
    return found


def _devices(feelings: Feelings) -> dict[str, float]:
    found: dict[str, float] = {"Battery/Charge/Sensor": feelings.charge}
    for name in BODY:
        found[f"{name}/Position/Sensor"] = feelings.angles[name]
        found[f"{name}/Position/Actuator"] = feelings.targets[name]
        found[f"{name}/Hardness/Actuator"] = feelings.stiffness[name]
        found[f"{name}/Temperature/Sensor"] = feelings.heat[name]
    rows = {"Angle": feelings.tilt, "Gyroscope": feelings.turning, "Accelerometer": feelings.pull}
    for name, row in rows.items():
        found |= {f"InertialSensor/{name}{axis}/Sensor": part for axis, part in zip(AXES, row, strict=True)}
    for side, weights in feelings.feet.items():
        found |= {f"{side}Foot/FSR/{corner}/Sensor": part for corner, part in zip(CORNERS, weights, strict=True)}
        found[f"{side}Foot/FSR/TotalWeight/Sensor"] = sum(weights)
    for places, _ in TOUCHES.values():
        found |= {f"{place}/Sensor": float(place in feelings.pressed) for place in places}
    return found
