"""Entry point of the core agent: builds the parts, steps the FSM until SIGINT or SIGTERM."""

import json
import logging
import os
import signal
import sys
import threading
from dataclasses import replace

import rospy

from rapp_agent import Subsystem
from rapp_core.config import Config, read
from rapp_core.control.attention import Attention, OwnVoice
from rapp_core.control.cloud_agent import CloudAgents
from rapp_core.control.control import Control
from rapp_core.control.fsm import core_machine
from rapp_core.control.parts import Parts
from rapp_core.control.platform import API_VERSION, Platform
from rapp_core.control.run_reports import RunReports
from rapp_core.control.words import STOP
from rapp_core.errors import CoreError, Invalid
from rapp_core.launcher.launcher import Launcher
from rapp_core.launcher.lease import Lease
from rapp_core.ports import Voice
from rapp_core.robot.naoqi import robot, subscriber
from rapp_core.robot.naoqi.connection import Connection
from rapp_core.robot.naoqi.guard import Guard
from rapp_core.ros.actions import RosActions
from rapp_core.ros.hop import RosHop
from rapp_core.ros.node import join, leave, log_to_stderr
from rapp_core.ros.services import RosServices, offered
from rapp_core.ros.state import StatePublisher
from rapp_core.ros.topics.offer import streams
from rapp_core.services.context import Context
from rapp_core.services.executor import Executor
from rapp_core.services.keepsakes import Keepsakes
from rapp_core.services.outside import Outside
from rapp_core.trace import Trace
from rapp_ros.rejoin import Rejoining

NODE = "core_agent"

_log = logging.getLogger(__name__)


def main() -> int:
    """Run the core agent; gives the exit status."""
    log_to_stderr()
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    try:
        config = read(sys.argv[1:])
        launcher = Launcher(config, _ros_environment(), offered(rospy.resolve_name(NODE)))
        launcher.open()
    except (CoreError, OSError) as error:
        _log.error("%s", error)
        return 2 if isinstance(error, Invalid) else 1
    try:
        if join(NODE, stop):
            with Guard(config.robot, subscriber(config), config.home):
                _run(config, launcher, stop)
        farewell = leave()
    except CoreError as error:
        _log.error("%s", error)
        return 1
    finally:
        launcher.close()
    if not farewell:
        _log.warning("the ROS master does not take the farewell; leaving without")
        os._exit(0)  # rospy's own exit handler would wait for the master without bound
    return 0


def _run(config: Config, launcher: Launcher, stop: threading.Event) -> None:
    connection = Connection(config.robot, config.naoqi_timeout)
    nao = robot(connection, config)
    voice = OwnVoice(nao.voice, config)
    attention = Attention(nao.ears, STOP.get(config.language), config, voice)
    nao = replace(nao, voice=voice, ears=attention)
    trace, states, lease = Trace(), StatePublisher(), Lease(config)
    trace.listen(states.tell)
    context, hop = Context(nao, config, trace, config.home / "listening", cut=stop), RosHop(stop, trace)
    executor = Executor(context)
    platform, cloud_agents = Platform(hop, config), CloudAgents(hop, config)
    reports = RunReports(launcher, hop, config.home, API_VERSION)
    reports.start(trace)
    control = Control(Parts(nao, attention, hop, reports, executor, platform, cloud_agents, lease, trace, config, stop))
    RosServices(executor, Outside(hop, cloud_agents, config, stop), Keepsakes(config), lease, trace)
    RosActions(executor, lease, trace)
    machine, rejoining = core_machine(control), Rejoining()
    machine.listen(trace.core_event)
    topics = streams(nao, hop, trace, lambda: context.place.odom, lambda: lease.held, config)
    for stream in topics:
        stream.start()
    threading.Thread(target=_hush_at_end, args=(nao.voice, stop), name="hush", daemon=True).start()
    print("READY " + json.dumps({"node": rospy.get_name()}), flush=True)
    share = Subsystem("core", memory={"problem": None})
    try:
        while not stop.is_set():
            machine.step(share)
    finally:
        stop.set()
        rejoining.close()
        for stream in topics:
            stream.close()
        control.close()
        reports.close()
        platform.close()
        states.close()
        connection.close()


def _hush_at_end(voice: Voice, stop: threading.Event) -> None:
    """Stop speaking when the process is told to end: its main thread may be waiting for a text to be said."""
    stop.wait()
    try:
        voice.hush()
    except CoreError as error:
        _log.info("%s", error)


def _ros_environment() -> dict[str, str]:
    """What a dynamic agent needs to join the same ROS."""
    wanted = ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME", "ROS_NAMESPACE")
    return {name: os.environ[name] for name in wanted if name in os.environ}


if __name__ == "__main__":
    sys.exit(main())
