"""Virtual receptor r_body on ALMemory, ALMotion and ALSonar."""

import contextlib
import math
import threading
from collections.abc import Callable
from typing import Any

from rapp_core.body_ports import Pose2D, Senses
from rapp_core.errors import CoreError
from rapp_core.robot.naoqi.connection import Connection

PERIOD = 100  # ms, of the sonars
PRECISION = 0.0
FARTHEST = 5.0  # m, what NAOqi gives when no echo comes
LYING = 0.9  # rad that the torso leans when the robot has fallen, or cannot stay on its feet
PLACE = "Device/SubDeviceList/{}/Sensor/Value"
HEAD = PLACE.format("Head/Touch/Middle")
KEYS = [
    PLACE.format(part)
    for part in (
        "US/Left", "US/Right", "LFoot/Bumper/Left", "LFoot/Bumper/Right", "RFoot/Bumper/Left", "RFoot/Bumper/Right",
        "InertialSensor/AngleX", "InertialSensor/AngleY", "Battery/Charge",
    )
]  # fmt: skip


class NaoqiFeeling:
    """See `body_ports.Feeling`."""

    def __init__(self, connection: Connection, name: str) -> None:
        """`name` is that under which the sonars are asked to work."""
        self._connection = connection
        self._name = name
        self._lock = threading.Lock()
        self._sonar: Any = None  # the module that was asked to work: another one after the session was lost
        self._joints: list[str] = []

    def senses(self) -> Senses:
        """See `body_ports.Feeling`. What is asked is asked at once, so that it is of one moment."""
        self._wake()
        asked = [self._ask("ALMemory", "getListData", KEYS), self._ask("ALMotion", "getAngles", "Body", True)]
        asked.append(self._ask("ALMotion", "getRobotVelocity"))
        values, angles, velocity = (answer() for answer in asked)
        left, right, *bumpers, roll, pitch, battery = values
        return Senses(
            joints=dict(zip(self._joints, map(float, angles), strict=True)),
            sonar=(_echo(left), _echo(right)),
            bumpers=(any(map(bool, bumpers[:2])), any(map(bool, bumpers[2:]))),
            battery=math.nan if battery is None else float(battery),
            velocity=Pose2D(*map(float, velocity)),
            fallen=max(abs(float(roll or 0.0)), abs(float(pitch or 0.0))) > LYING,
        )

    def _ask(self, module: str, method: str, *args: Any) -> Callable[[], Any]:
        future = self._connection.start(module, method, *args)
        return lambda: self._connection.result(future, module, method)

    def touched(self) -> bool:
        """See `body_ports.Feeling`."""
        return bool(self._connection.call("ALMemory", "getData", HEAD))

    def close(self) -> None:
        """See `body_ports.Feeling`."""
        with self._lock:  # to its end: sonars that somebody else wakes meanwhile are to stay awake
            sonar, self._sonar = self._sonar, None
            if sonar is not None and self._connection.present:
                with contextlib.suppress(CoreError):
                    self._connection.call("ALSonar", "unsubscribe", self._name)

    def _wake(self) -> None:
        with self._lock:
            if not self._joints:
                self._joints = [str(name) for name in self._connection.call("ALMotion", "getBodyNames", "Body")]
            sonar = self._connection.service("ALSonar")
            if sonar is not self._sonar:
                self._connection.call("ALSonar", "subscribe", self._name, PERIOD, PRECISION)
                self._sonar = sonar


def _echo(value: Any) -> float:
    return float(value) if value is not None and 0 < value < FARTHEST else math.inf
