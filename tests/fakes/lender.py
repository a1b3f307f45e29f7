"""A RApp that lends its lease: it runs as any other, and a program outside of its sandbox calls the core agent in its place."""

import re
import time
from pathlib import Path

from fakes.rapps import install_rapp
from fakes.whole_robot import PATIENCE, WholeRobot, entered
from rapp_core.services.table import CORE_SERVICES

NAME = "lender"
BODY = """from rapp_api.core_agent import current
print("LENT", current()._header["rapp_channel"], flush=True)
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
        for log in robot.home.glob("runs/*/agent.log"):
            found = re.search(r"^LENT (\S+)$", log.read_text(), re.MULTILINE)
            if found:
                return found[1]
        time.sleep(0.05)
    raise AssertionError(f"the lender does not lend\n{robot.story(since)}")
