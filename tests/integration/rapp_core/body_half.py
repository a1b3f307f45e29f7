"""The half of the core agent that serves the body, as a process of its own: real ROS, a real robot; the lease is held by a token.

python body_half.py ROBOT TOKEN FOLDER; a line on stdin ends the lease and is answered.
"""

import json
import sys
import threading
from pathlib import Path

from fakes.agents import FakeAgent, Script
from fakes.clock import Clock
from fakes.rapps import write_rapp
from rapp_core.config import Config
from rapp_core.control.cloud_agent import CloudAgents
from rapp_core.launcher.lease import Lease
from rapp_core.manifest import read_manifest
from rapp_core.robot.naoqi import robot
from rapp_core.robot.naoqi.connection import Connection
from rapp_core.ros.actions import RosActions
from rapp_core.ros.hop import RosHop
from rapp_core.ros.node import join, leave
from rapp_core.ros.services import RosServices
from rapp_core.services.context import Context
from rapp_core.services.executor import Executor
from rapp_core.services.keepsakes import Keepsakes
from rapp_core.services.outside import Outside
from rapp_core.services.table import CORE_SERVICES
from rapp_core.trace import Trace


def main(url: str, token: str, folder: Path) -> None:
    stop = threading.Event()
    config, trace = Config(robot=url, home=folder, name="half"), Trace()
    lease = Lease(config)
    connection = Connection(url, config.naoqi_timeout)
    join("body_half", stop)
    context = Context(robot(connection, config), config, trace, folder)
    executor, hop = Executor(context), RosHop(stop, trace)
    RosServices(executor, Outside(hop, CloudAgents(hop, config), config, stop), Keepsakes(config), lease, trace)
    RosActions(executor, lease, trace)
    permissions = {"core": [row.name for row in CORE_SERVICES], "cloud": []}
    package = write_rapp(folder / "run" / "package", "mover", permissions=permissions)
    agent = FakeAgent(Clock(), folder / "run", read_manifest(package), Script(), [], lambda _message: None)
    agent.token = token
    lease.grant(agent)
    print("READY " + json.dumps({}), flush=True)
    for _line in sys.stdin:
        lease.release()
        print(context.calls.take_before() is not None, flush=True)
        lease.grant(agent)
    stop.set()
    connection.close()
    leave()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
