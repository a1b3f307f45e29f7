"""Entry point of the core agent: builds the parts, steps the FSM until SIGINT or SIGTERM."""

import json
import logging
import os
import signal
import sys
import threading
import time

import rospy

from rapp_agent import Subsystem
from rapp_core.config import Config, read
from rapp_core.control.control import Control, Parts
from rapp_core.control.fsm import core_machine
from rapp_core.control.lease import Lease
from rapp_core.control.platform import Platform
from rapp_core.errors import Invalid
from rapp_core.launcher.launcher import Launcher
from rapp_core.robot.naoqi import robot
from rapp_core.robot.naoqi.connection import Connection
from rapp_core.ros.hop import RosHop
from rapp_core.ros.services import RosServices
from rapp_core.ros.state import StatePublisher
from rapp_core.services.context import Context
from rapp_core.services.executor import Executor
from rapp_core.services.outside import Outside
from rapp_core.trace import Trace

_log = logging.getLogger(__name__)


def main() -> int:
    """Run the core agent; gives the exit status."""
    _log_to_stderr()
    try:
        config = read(sys.argv[1:])
    except Invalid as error:
        _log.error("%s", error)
        return 2
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    rospy.init_node("core_agent", disable_signals=True)
    _log_to_stderr()
    _run(config, stop)
    rospy.signal_shutdown("the core agent ends")
    return 0


def _log_to_stderr() -> None:
    """Also after rospy has put its own handlers in place of everybody's."""
    line = "%(asctime)s %(name)s %(levelname)s %(message)s"
    logging.basicConfig(level=logging.INFO, format=line, stream=sys.stderr, force=True)
    for logger in map(logging.getLogger, list(logging.root.manager.loggerDict)):
        logger.disabled = False


def _run(config: Config, stop: threading.Event) -> None:
    connection = Connection(config.robot, config.naoqi_timeout)
    nao = robot(connection, config)
    trace, states, lease = Trace(), StatePublisher(), Lease(config)
    trace.listen(states.tell)

    def recordings() -> "os.PathLike[str]":
        run = lease.holder
        return run.folders.recordings if run is not None else config.home / "listening"

    context = Context(nao, config, trace, lease.cut, time.monotonic, recordings)  # type: ignore[arg-type]
    executor, hop = Executor(context), RosHop()
    launcher = Launcher(config, _ros_environment())
    platform = Platform(hop, config, trace)
    control = Control(Parts(nao, hop, launcher, executor, platform, lease, trace, config, stop))
    services = RosServices(executor, Outside(hop, config, trace), lease, trace)
    machine = core_machine(control)
    machine.listen(trace.core_event)
    print("READY " + json.dumps({"node": rospy.get_name()}), flush=True)
    share = Subsystem("core", memory={"problem": None})
    try:
        while not stop.is_set():
            machine.step(share)
    finally:
        platform.close()
        control.close()
        launcher.close()
        services.close()
        hop.close()
        states.close()
        connection.close()


def _ros_environment() -> dict[str, str]:
    """What a dynamic agent needs to join the same ROS."""
    wanted = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE")
    return {name: os.environ[name] for name in wanted if name in os.environ}


if __name__ == "__main__":
    sys.exit(main())
