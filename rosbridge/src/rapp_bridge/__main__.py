"""Entry point: reads the settings, joins ROS, serves WebSocket clients until SIGINT or SIGTERM."""

import asyncio
import json
import logging
import os
import signal
import sys

import rosgraph
import rospy
from rospy.impl import tcpros_base
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets

from rapp_bridge.blocking import Blocking
from rapp_bridge.calls import Calls
from rapp_bridge.config import Config, read
from rapp_bridge.master import Master
from rapp_bridge.offers import Offers
from rapp_bridge.ros import Ros
from rapp_bridge.server import Hall, application
from rapp_bridge.topics import Topics
from rapp_ros.rejoin import Rejoining

BACKLOG = 128  # callers that may connect to a client's service at once; rospy's own 5 makes the sixth wait 1 s
THREADS = 8  # for what asks the master
LEAVE = 0.7  # s for each part of the end

_log = logging.getLogger(__name__)


def main() -> int:
    """Run the bridge; gives the exit status."""
    config = read(sys.argv[1:], os.environ)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    asyncio.run(_serve(config))
    if not rospy.is_shutdown() and rospy.core.is_initialized():
        _log.warning("the ROS master does not take the farewell; leaving without")
        os._exit(0)  # rospy's own exit handler would wait for the master without bound
    return 0


async def _serve(config: Config) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    blocking = Blocking(THREADS)
    joining = asyncio.create_task(blocking.run(_join))
    await _first(joining, stop)
    if not stop.is_set():
        joining.result()
        rospy.on_shutdown(lambda: None if loop.is_closed() else loop.call_soon_threadsafe(stop.set))
        await _serve_joined(config, blocking, stop)
        await asyncio.wait([asyncio.create_task(blocking.run(rospy.signal_shutdown, "bridge ends"))], timeout=LEAVE)
    blocking.close()


def _join() -> None:
    """Join ROS as a node; waits for the master as long as it takes."""
    if not rosgraph.is_master_online():
        _log.warning("waits for the ROS master at %s; start roscore", rosgraph.get_master_uri())
    rospy.init_node("rosbridge", disable_signals=True, disable_rosout=True)
    tcpros_base._tcpros_server.tcp_ros_server.server_sock.listen(BACKLOG)


async def _first(task: "asyncio.Task[None]", stop: asyncio.Event) -> None:
    stopping = asyncio.create_task(stop.wait())
    await asyncio.wait([task, stopping], return_when=asyncio.FIRST_COMPLETED)
    stopping.cancel()


async def _serve_joined(config: Config, blocking: Blocking, stop: asyncio.Event) -> None:
    caller = rospy.get_name()
    master = Master(rosgraph.get_master_uri(), caller, config.master_timeout)
    topics, offers = Topics(config, master), Offers(config)
    calls = Calls(config, master, blocking, caller)
    hall = Hall(config, Ros(config, topics, calls, offers, blocking))
    sockets = bind_sockets(config.port, config.address)
    server = HTTPServer(application(hall))
    server.add_sockets(sockets)
    sweeping = asyncio.create_task(_sweep(topics, blocking))
    rejoining = Rejoining()
    print("READY " + json.dumps({"port": sockets[0].getsockname()[1]}), flush=True)
    await stop.wait()
    rejoining.close()
    server.stop()
    sweeping.cancel()
    offers.close()
    await server.close_all_connections()
    if hall.leaving:
        await asyncio.wait(hall.leaving, timeout=LEAVE)
    calls.close()


async def _sweep(topics: Topics, blocking: Blocking) -> None:
    while True:
        await asyncio.sleep(1.0)
        await blocking.run(topics.sweep)


if __name__ == "__main__":
    sys.exit(main())
