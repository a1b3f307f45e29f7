"""The process of a cloud agent: a warm spare at first, then the program it is told to be (`python -m rapp_hop.cloud_agent_runner`).

Started by a_rep inside a sandbox, which hands in by number: its end of the channel (JSON objects, one per line) and a listening
socket. Order of messages: ready; activate from a_rep; serving, or failed with a message; alive every `BEAT` from the loop, so that
a loop that stands still is seen.
"""

import asyncio
import importlib.util
import json
import logging
import os
import signal
import socket
import sys
import tempfile
from pathlib import Path
from typing import Any

from rapp_hop.cloud_agent import repository
from rapp_hop.errors import HopError
from rapp_hop.registry import ServiceRegistry
from rapp_hop.server import HopServer
from rapp_hop.service import Service

BEAT = 1.0  # s between signs of life
LONGEST = 256 * 1024  # bytes of the order

_log = logging.getLogger(__name__)


def main() -> None:
    """Warm up, become the cloud agent, end at SIGTERM or with the platform."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    asyncio.run(_run())
    logging.shutdown()
    os._exit(0)  # threads of the program must not keep the process


async def _run() -> None:
    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    channel = socket.socket(fileno=int(os.environ["RAPP_AGENT_CHANNEL"]))
    reader, writer = await asyncio.open_unix_connection(sock=channel, limit=LONGEST)
    tasks = [asyncio.create_task(_beat(writer)), asyncio.create_task(stop.wait())]
    tasks.append(asyncio.create_task(_live(reader, writer)))
    await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


async def _beat(writer: asyncio.StreamWriter) -> None:
    while True:
        _tell(writer, type="alive")
        await writer.drain()
        await asyncio.sleep(BEAT)


async def _live(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """From "ready" to the end of the channel, which is that of the platform."""
    _tell(writer, type="ready")
    line = await reader.readline()
    if not line:
        return
    order = json.loads(line)
    try:
        server, client = await _become(order)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - told to the platform, whatever it is
        _log.error("the cloud agent cannot start", exc_info=error)
        _tell(writer, type="failed", message=f"{type(error).__name__}: {error}"[:500])
        await writer.drain()
        return
    try:
        _tell(writer, type="serving")
        await reader.read()
    finally:
        await server.close()
        await client.close()


async def _become(order: dict[str, Any]) -> tuple[HopServer, Any]:
    client = repository.connect(Path(os.environ["RAPP_AGENT_PLATFORM"]))
    registry = ServiceRegistry(_services(Path(order["package"]) / order["entry"]))
    robot = str(order["robot"])
    server = HopServer(registry, lambda _token: robot, Path(tempfile.gettempdir()) / "uploads")
    server.listen_on(socket.socket(fileno=int(os.environ["RAPP_AGENT_LISTENER"])))
    return server, client


def _services(entry: Path) -> list[Service]:
    """Run the program and return its services; modules beside it can be imported."""
    spec = importlib.util.spec_from_file_location("rapp_cloud_entry", entry)
    if spec is None or spec.loader is None:
        raise ImportError(f"{entry.name} is no Python file")
    sys.path.insert(0, str(entry.parent))
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    found = [value for value in vars(module).values() if isinstance(value, Service)]
    if not found:
        raise HopError(f"{entry.name} has no service; mark what the dynamic agent may call with @service")
    return found


def _tell(writer: asyncio.StreamWriter, **message: Any) -> None:
    writer.write(json.dumps(message).encode() + b"\n")


if __name__ == "__main__":
    main()
