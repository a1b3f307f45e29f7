"""Entry point of `robot`: starts all processes of one robot, ends them on SIGINT or SIGTERM, or when one of them ends."""

import json
import logging
import os
import signal
import sys
import threading

from rapp_core.robot_processes.child import ChildError
from rapp_core.robot_processes.config import read
from rapp_core.robot_processes.robot import RobotProcesses

LOOK = 0.5  # s between two looks at the children

_log = logging.getLogger(__name__)


def main() -> int:
    """Run the robot; gives the exit status: 0 when told to end, 1 when a process failed."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    config = read(sys.argv[1:])
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    robot = RobotProcesses(config, os.environ, stop)
    try:
        print("READY " + json.dumps(robot.start()), flush=True)
        while not stop.wait(LOOK):
            child = robot.ended()
            if child is not None:
                _log.error("%s ended with status %s, so the robot ends\n%s", child.name, child.status, child.tail())
                return 1
    except ChildError as error:
        if not stop.is_set():
            _log.error("%s", error)
            return 1
    finally:
        robot.end()
    return 0


if __name__ == "__main__":
    sys.exit(main())
