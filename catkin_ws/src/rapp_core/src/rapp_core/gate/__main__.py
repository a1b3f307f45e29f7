"""The process of a gate: `python -m rapp_core.gate`, started by the launcher, ended by the end of its control channel."""

import argparse
import asyncio
import contextlib
import ctypes
import json
import logging
import os
import resource
import signal
import socket
import sys

import uvloop

from rapp_core.errors import CoreError
from rapp_core.gate.doors import Doors
from rapp_core.gate.inside import Inside
from rapp_core.gate.master import Master
from rapp_core.gate.rules import from_json
from rapp_core.gate.upstream import Upstream

BEAT = 0.25  # s between two signs of life
FAREWELL = 0.5  # s for the robot's master to take note of the end
MEMORY = 1 << 30  # bytes of address space: whatever a RApp sends, the robot keeps its memory
FILES = 512
LINES = 200  # in the log
ACCOUNT = 65533  # user id of gates that root starts (Debian policy section 9.2.2)
_PR_SET_PDEATHSIG = 1  # prctl(2)


def main() -> int:
    """Run a gate; gives the exit status."""
    parser = argparse.ArgumentParser(prog="gate", description="the way out of one dynamic agent's sandbox")
    for name, kind in (("control", int), ("inside", int), ("master", str), ("node", str)):
        parser.add_argument(f"--{name}", type=kind, required=True)
    options = parser.parse_args()
    logging.basicConfig(
        level=logging.INFO, format=f"%(asctime)s gate of {options.node} %(levelname)s %(message)s", stream=sys.stderr
    )
    logging.getLogger().handlers[0].addFilter(Few())
    _confine()
    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        runner.run(_serve(options))
    logging.shutdown()
    os._exit(0)  # a thread may still wait for the ROS master


class Few(logging.Filter):
    """Lets so many lines of one run into the log: what a RApp has refused to it must not fill the disk."""

    def __init__(self) -> None:
        super().__init__()
        self._count = 0

    def filter(self, record: logging.LogRecord) -> bool:
        """See logging."""
        self._count += 1
        return self._count <= LINES


def _confine() -> None:
    """Hold what a hostile RApp could make of a fault here: no rights, bounded memory, no life beyond the core agent's."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_NOFILE, (FILES, FILES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if os.geteuid() == 0:
        os.setgroups([])
        os.setresgid(ACCOUNT, ACCOUNT, ACCOUNT)
        os.setresuid(ACCOUNT, ACCOUNT, ACCOUNT)
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


async def _serve(options: argparse.Namespace) -> None:
    reader, writer = await asyncio.open_connection(sock=socket.socket(fileno=options.control))
    inside, upstream = Inside(socket.socket(fileno=options.inside)), Upstream(options.master, options.node)

    def tell(**message: str) -> None:
        writer.write(json.dumps(message).encode() + b"\n")

    async def beat() -> None:
        while True:
            tell(type="beat")
            await asyncio.sleep(BEAT)

    async def guard() -> None:
        questions, relay = await inside.arrive()
        host, port = questions.getsockname()
        master = Master(upstream, f"http://{host}:{port}/", relay.getsockname()[1])
        doors.append(Doors(upstream, inside, master, lambda uri: tell(type="api", uri=uri)))
        doors[0].serve(questions, relay)

    doors: list[Doors] = []
    beating, guarding = asyncio.create_task(beat()), asyncio.create_task(guard())
    with contextlib.suppress(OSError, CoreError):
        while line := await reader.readline():
            order = json.loads(line)
            await guarding
            doors[0].admit(from_json(order["rules"]), order["secret"])
            tell(type="opened")
    for task in (beating, guarding):
        task.cancel()
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(FAREWELL):
            for each in doors:
                await each.close()


if __name__ == "__main__":
    sys.exit(main())
