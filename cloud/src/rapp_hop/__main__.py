"""`python -m rapp_hop MODULE`: serve the services of a Python module.

Every `@service` among the module's names is served. For services that keep nothing in memory: with more processes than one,
any of them may take a call.
"""

import argparse
import asyncio
import ctypes
import hmac
import importlib
import json
import logging
import os
import signal
import socket
import sys
from collections.abc import Mapping
from pathlib import Path

import uvloop
from tornado.netutil import bind_sockets

from rapp_hop import strict_json
from rapp_hop.errors import HopError, Invalid, Refused
from rapp_hop.processes import Processes, command
from rapp_hop.registry import ServiceRegistry
from rapp_hop.server import HopServer, ServerLimits
from rapp_hop.service import Authenticate, Service

_PR_SET_PDEATHSIG = 1


def main(words: list[str] | None = None) -> int:
    """Serve until a signal comes; the exit status."""
    logging.basicConfig(stream=sys.stderr, level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s")
    options = _options(sys.argv[1:] if words is None else words)
    try:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            return runner.run(_one(options) if options.processes == 1 or options.fd is not None else _many(options))
    except (HopError, OSError, ImportError) as error:
        print(error, file=sys.stderr)
    return 1


def _options(words: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m rapp_hop", description=__doc__)
    parser.add_argument("module", help="importable, with services made by @service")
    parser.add_argument("--port", type=int, default=0, help="0: any free one (%(default)s)")
    parser.add_argument("--address", default="127.0.0.1", help="to listen on (%(default)s)")
    parser.add_argument("--tokens", type=Path, required=True, metavar="FILE", help="JSON: callers by their tokens")
    parser.add_argument("--uploads", type=Path, required=True, metavar="DIR", help="folder for files while a call runs")
    parser.add_argument("--processes", type=int, default=1, help="that share the port (%(default)s)")
    parser.add_argument("--rate", type=float, default=1000.0, help="calls per second of one caller (%(default)s)")
    parser.add_argument("--fd", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--parent", type=int, help=argparse.SUPPRESS)
    return parser.parse_args(words)


async def _one(options: argparse.Namespace) -> int:
    if options.parent is not None and not _end_with(options.parent):
        return 0
    limits = ServerLimits(rate=options.rate, burst=2 * options.rate)
    services = ServiceRegistry(services_of(options.module))
    server = HopServer(services, authenticator(options.tokens), options.uploads, limits=limits)
    try:
        if options.fd is None:
            port = server.listen(options.port, options.address)
        else:
            listening = socket.socket(fileno=options.fd)
            port = listening.getsockname()[1]
            server.listen_on(listening)
        await _until_signal({"port": port})
    finally:
        await server.close()
    return 0


async def _many(options: argparse.Namespace) -> int:
    services_of(options.module)  # what is wrong with it is said once
    try:
        listening = bind_sockets(options.port, options.address, socket.AF_INET)[0]
    except OSError as error:
        raise Refused(f"cannot listen on {options.address}:{options.port}: {error.strerror}, choose another port") from None
    words = command(options.module, "--tokens", options.tokens, "--uploads", options.uploads, "--rate", options.rate)
    processes = Processes(words, listening, options.processes)
    try:
        await processes.start()
        await _until_signal({"port": listening.getsockname()[1], "pids": sorted(processes.pids)})
    finally:
        await processes.close()
        listening.close()
    return 0


async def _until_signal(ready: Mapping[str, object]) -> None:
    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    print("READY " + json.dumps(ready), flush=True)
    await stop.wait()


def _end_with(parent: int) -> bool:
    """Have the kernel end this process with its parent; False when that is gone already."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    return os.getppid() == parent


def services_of(module: str) -> list[Service]:
    """Return the services among a module's names.

    :raises Invalid: when there are none
    """
    found = {id(item): item for item in vars(importlib.import_module(module)).values() if isinstance(item, Service)}
    if not found:
        raise Invalid(f"cannot serve {module}: no name in it is a @service")
    return list(found.values())


def authenticator(path: Path) -> Authenticate:
    """Return who knows the callers of a file of tokens.

    :raises Refused: when it cannot be read
    :raises Invalid: when it is not an object of texts
    """
    try:
        known = strict_json.loads(path.read_bytes(), limit=2**20)
    except OSError as error:
        raise Refused(f"cannot read {path.name}: {error.strerror}") from None
    if not isinstance(known, dict) or not all(isinstance(caller, str) for caller in known.values()):
        raise Invalid(f"cannot read {path.name}: it must map tokens to callers")
    pairs = [(token.encode(), caller) for token, caller in known.items()]

    def caller_of(token: str | None) -> str | None:
        given = (token or "").encode("utf-8", "replace")
        return next((caller for known_token, caller in pairs if hmac.compare_digest(known_token, given)), None)

    return caller_of


if __name__ == "__main__":
    sys.exit(main())
