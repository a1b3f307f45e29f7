"""A RApp that lends its lease: it runs as any other, and a program outside of its sandbox calls the core agent in its place.

No RApp holds its secret: its gate adds it to what the RApp sends. Any node of the robot that hears what the RApp publishes sees it
in the header of that connection.
"""

import socket
import time
from io import BytesIO
from pathlib import Path
from typing import Any

from rosgraph.network import read_ros_handshake_header, write_ros_handshake_header

from fakes.rapps import install_rapp
from fakes.whole_robot import PATIENCE, WholeRobot, entered
from rapp_core.services.table import CORE_SERVICES
from rapp_ros.master import ask

NAME = "lender"
TOPIC = "/rapp_move_to/goal"
BODY = """from rapp_api import navigation
client = navigation.action_client("rapp_move_to")
while True:
    self.pause(0.5)"""
PERMISSIONS = {"core": [*(row.name for row in CORE_SERVICES), "rapp_keep"], "cloud": ["profile", "send_mail"]}


def install_lender(home: Path) -> None:
    """Put it where the robot finds it."""
    install_rapp(home, NAME, BODY, permissions=PERMISSIONS)


def borrow(robot: WholeRobot) -> str:
    """Have it run; gives the secret of its lease."""
    since, deadline = len(robot.seen), time.monotonic() + PATIENCE
    robot.ask(NAME)
    robot.until(entered("s9"), since)
    while time.monotonic() < deadline:
        nodes = [node for topic, nodes in _ask(robot, "getSystemState")[0] if topic == TOPIC for node in nodes]
        if nodes:
            return _secret(_ask(robot, "lookupNode", nodes[0]))
        time.sleep(0.05)
    raise AssertionError(f"the lender does not lend\n{robot.story(since)}")


def _secret(api: str) -> str:
    _, _, (_, host, port) = ask(api, PATIENCE, "requestTopic", "/borrower", TOPIC, [["TCPROS"]])
    with socket.create_connection((host, port), PATIENCE) as connection:
        write_ros_handshake_header(connection, {"topic": TOPIC, "callerid": "/borrower", "md5sum": "*", "type": "*"})
        return str(read_ros_handshake_header(connection, BytesIO(), 65536)["rapp_channel"])


def _ask(robot: WholeRobot, question: str, *words: Any) -> Any:
    return ask(robot.ros["ROS_MASTER_URI"], PATIENCE, question, "/borrower", *words)[2]
