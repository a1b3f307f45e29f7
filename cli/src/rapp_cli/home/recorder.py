"""`python -m rapp_cli.home.recorder`: writes every entry of the agents' states to a file, until SIGINT or SIGTERM."""

import argparse
import asyncio
import contextlib
import json
import logging
import signal
import sys
from pathlib import Path

from tornado.websocket import WebSocketError

from rapp_cli.timeline import Entry, append, follow, latest

LARGEST = 10 << 20  # bytes of the file, before it is put aside
AGAIN = 0.5  # s between tries to reach the rosbridge

_log = logging.getLogger("recorder")


class Record:
    """The file; it is put aside at a moment when no RApp runs, so that no run is torn apart."""

    def __init__(self, path: Path, largest: int = LARGEST) -> None:
        self._path = path
        self._largest = largest
        self._last = next(reversed(latest(path)), None)

    def add(self, entry: Entry) -> None:
        """Write an entry down, unless it is the last one again: it is latched, so it comes at every connection."""
        if entry == self._last:
            return
        self._last = entry
        listens = (entry.agent, entry.kind, entry.state) == ("core", "entered", "s3")
        if listens and self._path.exists() and self._path.stat().st_size > self._largest:
            self._path.replace(self._path.with_suffix(".1.jsonl"))
        append(self._path, entry)


async def record(bridge: str, path: Path) -> None:
    """Record until cancelled; a rosbridge that is away is tried again."""
    entries = Record(path)
    print("READY " + json.dumps({"file": str(path)}), flush=True)
    while True:
        try:
            async for entry in follow(bridge):
                entries.add(entry)
            _log.warning("the rosbridge has left: trying again")
        except (OSError, WebSocketError, TimeoutError) as error:
            _log.info("cannot record: %s; trying again", error)
        await asyncio.sleep(AGAIN)


async def _until_told(bridge: str, path: Path) -> None:
    task = asyncio.create_task(record(bridge, path))
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, task.cancel)
    with contextlib.suppress(asyncio.CancelledError):
        await task


def main() -> int:
    """Run the recorder; gives the exit status."""
    parser = argparse.ArgumentParser(prog="recorder", description="writes the agents' timeline to a file")
    parser.add_argument("--bridge", required=True, metavar="URL", help="WebSocket URL of a rosbridge")
    parser.add_argument("--file", type=Path, required=True, help="JSON lines, one per entry")
    options = parser.parse_args()
    logging.basicConfig(level=logging.WARNING, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    asyncio.run(_until_told(options.bridge, options.file))
    return 0


if __name__ == "__main__":
    sys.exit(main())
