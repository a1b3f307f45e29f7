"""Entry point: reads the settings, joins ROS, serves WebSocket clients until SIGINT or SIGTERM."""

import asyncio
import json
import logging
import os
import resource
import signal
import ssl
import sys
import time
from pathlib import Path

import rosgraph
import rospy
import uvloop

from rapp_bridge.access import Gate, read_tokens
from rapp_bridge.blocking import Blocking
from rapp_bridge.bridge import Bridge
from rapp_bridge.config import Config, read
from rapp_bridge.errors import Invalid
from rapp_bridge.node import join

THREADS = 8  # for what asks the master, and for pictures
GUEST_THREADS = 2  # it has one client, and shares the limits of a sandbox
LEAVE = 0.7  # s for each part of the end
SOCKETS = 2  # descriptors for each client, at most: its own, and its share of those to nodes

_log = logging.getLogger(__name__)


def main() -> int:
    """Run the bridge; gives the exit status."""
    config = read(sys.argv[1:], os.environ)
    _log_to_stderr()
    try:
        gate = Gate(read_tokens(Path(config.access_file).read_text()) if config.access_file else {}, time.time)
        tls = _tls(config)
    except (OSError, UnicodeDecodeError, Invalid) as error:
        _log.error("cannot start: %s", error)
        return 2
    _make_room(config.clients * SOCKETS)
    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        runner.run(_serve(config, gate, tls))
    if not rospy.is_shutdown() and rospy.core.is_initialized():
        _log.warning("the ROS master does not take the farewell; leaving without")
        os._exit(0)  # rospy's own exit handler would wait for the master without bound
    return 0


def _log_to_stderr() -> None:
    """rospy puts its own handlers in place when it joins, so it is called again then."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr, force=True)
    logging.getLogger("rospy").setLevel(logging.WARNING)


def _make_room(descriptors: int) -> None:
    """Ask the system for so many descriptors, when it allows fewer; what it does not give, is not used."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft != resource.RLIM_INFINITY and soft < descriptors:
        most = descriptors if hard == resource.RLIM_INFINITY else min(descriptors, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))


def _tls(config: Config) -> ssl.SSLContext | None:
    """TLS with the configured certificate; raises OSError."""
    if not config.certfile:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.load_cert_chain(config.certfile, config.keyfile or None)
    return context


async def _serve(config: Config, gate: Gate, tls: ssl.SSLContext | None) -> None:
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    blocking = Blocking(GUEST_THREADS if config.guest else THREADS)
    bridge = Bridge(config, gate, blocking)
    await bridge.door.open()
    joining = asyncio.create_task(blocking.run(join, bridge.door, bridge.connect))
    await _first(joining, stop)
    if not stop.is_set():
        joining.result()
        _log_to_stderr()
        rospy.on_shutdown(lambda: None if loop.is_closed() else loop.call_soon_threadsafe(stop.set))
        await _serve_joined(config, bridge, tls, stop)
        await asyncio.wait([asyncio.create_task(blocking.run(rospy.signal_shutdown, "bridge ends"))], timeout=LEAVE)
    bridge.door.close()
    blocking.close()


async def _first(task: "asyncio.Task[None]", stop: asyncio.Event) -> None:
    stopping = asyncio.create_task(stop.wait())
    await asyncio.wait([task, stopping], return_when=asyncio.FIRST_COMPLETED)
    stopping.cancel()


async def _serve_joined(config: Config, bridge: Bridge, tls: ssl.SSLContext | None, stop: asyncio.Event) -> None:
    port = await bridge.open(tls)
    _log.info("serves %s://%s:%d in the ROS of %s", "wss" if tls else "ws", config.address, port, rosgraph.get_master_uri())
    print("READY " + json.dumps({"port": port}), flush=True)
    await stop.wait()
    await bridge.close(LEAVE)


if __name__ == "__main__":
    sys.exit(main())
