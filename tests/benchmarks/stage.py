"""A robot in a hall, its real core agent, and this process in a RApp's place: what `robot.py` measures with."""

import logging
import math
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi reads it when loaded, and logs on stdout

import numpy as np
import rospy
from numpy.typing import NDArray

from fakes.lender import borrow, install_lender
from fakes.whole_robot import WholeRobot, whole_robot
from rapp_api import core_agent
from rapp_api.ros_core_agent import RosCoreAgent
from rapp_core.robot.naoqi.connection import Connection

HALL = Path(__file__).with_name("robot_room.toml")
SETTINGS = """
register_timeout = 0.5
camera_rate = 30.0
camera_resolution = 2
"""
SETTLED = 0.5  # s after which a head that has been turned does not swing any more

Matrix = NDArray[np.float64]
Pose = tuple[float, float, float]


@dataclass(frozen=True)
class Result:
    """One line of the table; `bare` is the same without what is measured, in the same run; no aim: for information."""

    what: str
    reached: str
    aim: str = ""
    bare: str = ""
    kept: bool = True


@dataclass(frozen=True)
class Stage:
    """The running robot."""

    robot: WholeRobot
    naoqi: Connection
    start: Pose  # where odometry began

    def pose(self) -> Pose:
        """Where the robot truly is: middle of the soles, heading."""
        x, y, theta = self.robot.room("getRobotPose")
        return x, y, theta

    def link(self, name: str) -> Matrix:
        """Where a link truly is, in the room."""
        return np.array(self.robot.room("getLink", name)).reshape(4, 4)


@contextmanager
def staged(folder: Path) -> Iterator[Stage]:
    """Everything running; ended afterwards."""
    robot = WholeRobot(folder, body=True)
    robot.body = ("--room", str(HALL))
    robot.settings = SETTINGS
    install_lender(robot.home)
    with whole_robot(robot, "roscore", "nao_sim", "core_agent"):
        os.environ |= robot.ros
        rospy.init_node("bench", anonymous=True, disable_signals=True, disable_rosout=True)
        logging.getLogger().handlers.clear()  # rospy's
        end = core_agent.use(RosCoreAgent(borrow(robot)))
        x, y, theta = robot.room("getRobotPose")
        try:
            yield Stage(robot, robot.naoqi, (x, y, theta))
        finally:
            end()
            rospy.signal_shutdown("measured")


def matrix(pose: Pose) -> Matrix:
    """A pose on the ground as 4x4 matrix."""
    x, y, theta = pose
    found = np.eye(4)
    found[:2, :2] = [[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]]
    found[:2, 3] = x, y
    return found


def angle(rotation: Matrix) -> float:
    """By how much a rotation turns, degrees."""
    return math.degrees(2 * math.asin(min(1.0, float(np.linalg.norm(rotation - np.eye(3))) / math.sqrt(8))))


def settle() -> None:
    """Let what swings come to rest."""
    time.sleep(SETTLED)
