"""Entry point: reads the settings, joins ROS, serves WebSocket clients until SIGINT or SIGTERM."""

import asyncio
import json
import logging
import signal
import sys

import rospy
from rospy.impl import tcpros_base
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets

from rapp_bridge.config import Config, read
from rapp_bridge.server import application
from rapp_bridge.services import Calls, Offers
from rapp_bridge.session import Session
from rapp_bridge.topics import Topics

BACKLOG = 128  # callers that may connect to a client's service at once; rospy's own 5 makes the sixth wait 1 s


def main() -> int:
    """Run the bridge; gives the exit status."""
    config = read(sys.argv[1:])
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    asyncio.run(_serve(config))
    return 0


async def _serve(config: Config) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    await loop.run_in_executor(None, lambda: rospy.init_node("rosbridge", disable_signals=True, disable_rosout=True))
    tcpros_base._tcpros_server.tcp_ros_server.server_sock.listen(BACKLOG)
    topics, calls, offers = Topics(), Calls(config), Offers(config)
    sockets = bind_sockets(config.port, config.address)
    server = HTTPServer(application(config, lambda client: Session(client, topics, calls, offers)))
    server.add_sockets(sockets)
    print("READY " + json.dumps({"port": sockets[0].getsockname()[1]}), flush=True)
    await stop.wait()
    server.stop()
    await server.close_all_connections()
    calls.close()
    await loop.run_in_executor(None, rospy.signal_shutdown, "bridge ends")


if __name__ == "__main__":
    sys.exit(main())
