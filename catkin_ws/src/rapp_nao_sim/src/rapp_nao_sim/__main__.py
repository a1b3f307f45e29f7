"""Entry point: reads the settings, runs the simulated robot until SIGINT or SIGTERM."""

import json
import logging
import os
import signal
import sys
import threading

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi logs on stdout otherwise; read when it is loaded
os.environ.setdefault("QI_EVENTLOOP_MIN_THREADS", "8")

from rapp_nao_sim.config import read
from rapp_nao_sim.host import Host


def main() -> int:
    """Run the simulator; gives the exit status."""
    config = read(sys.argv[1:])
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    world = None
    if config.world:
        from rapp_nao_sim.world.process import WorldClient

        world = WorldClient()
        world.start()
    host = Host(config, world)
    try:
        print("READY " + json.dumps({"port": host.start()}), flush=True)
        while not stop.wait(1.0):
            pass
    finally:
        host.close()
        if world is not None:
            world.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
