"""Entry point: reads the settings, runs the simulated robot until SIGINT or SIGTERM."""

import json
import logging
import os
import signal
import sys
import threading
from contextlib import closing

os.environ.setdefault("QI_LOG_LEVEL", "1")  # libqi logs on stdout otherwise; read when it is loaded
os.environ.setdefault("QI_EVENTLOOP_MIN_THREADS", "8")

from rapp_nao_sim.config import read
from rapp_nao_sim.errors import SimError
from rapp_nao_sim.host import Host
from rapp_nao_sim.world.errors import WorldError

LOOK = 0.5  # s between two looks at the simulator's processes

_log = logging.getLogger("nao_sim")


def main() -> int:
    """Run the simulator; gives the exit status."""
    config = read(sys.argv[1:])
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    try:
        with closing(Host(config)) as host:
            print("READY " + json.dumps({"port": host.start()}), flush=True)
            while not stop.wait(LOOK):
                host.look_after()
    except (SimError, WorldError) as error:
        _log.error("%s", error)
        return 1
    return 0


if __name__ == "__main__":
    status = main()
    logging.shutdown()
    sys.stdout.flush()
    os._exit(status)  # libqi's threads live on: one that comes back to an interpreter that ends aborts the process
