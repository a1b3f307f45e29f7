"""A robot on a bench whose services walk it."""

import math
from typing import Any

import pytest

from fakes.bench import Bench
from rapp_core.body_ports import Pose2D
from rapp_core.services.place import Waypoint

CONFIG = {"motion_time": 300.0, "walk_distance": 10.0, "near": 0.3, "walk_speed": 0.1, "side_speed": 0.06, "turn_speed": 0.5}
HAZARDS: dict[str, dict[str, Any]] = {
    "bumper of the left": {"bumpers": (True, False)},
    "bumper of the right": {"bumpers": (False, True)},
    r"0\.25 m ahead, seen by the right": {"sonar": (math.inf, 0.25)},
    "fallen": {"fallen": True},
}


def walk(bench: Bench, x: float = 1.0, y: float = 0.0, theta: float = 0.0) -> None:
    bench.call("rapp_move_to", x=x, y=y, theta=theta)


def along(bench: Bench, *poses: tuple[str, float, float, float]) -> None:
    bench.call("rapp_move_along_path", poses=[Waypoint(frame, Pose2D(*pose)) for frame, *pose in poses])


def drive(bench: Bench, x: float = 0.1, y: float = 0.0, theta: float = 0.0) -> None:
    bench.call("rapp_move_vel", x=x, y=y, theta=theta)


def near(pose: Pose2D, x: float, y: float, theta: float) -> bool:
    return (pose.x, pose.y, pose.theta) == pytest.approx((x, y, theta), abs=1e-6)
