"""Several processes that serve the same services on one listening socket, so that they use all cores.

For services without state in memory: whichever process is free takes the next connection. (The platform's own, `rapp_cloud`,
keeps leases, lanes and answered calls in memory and is one process; what is heavy there runs in worker processes.)
"""

import asyncio
import logging
import os
import socket
import subprocess
import sys
from collections.abc import Sequence

from rapp_hop.errors import Refused

RESTART = 1.0  # seconds before a process that died is started again
END = 2.0  # seconds to end by itself
_log = logging.getLogger(__name__)


class Processes:
    """The serving processes; start with `start()`, end with `close()`. One that dies is replaced."""

    def __init__(self, words: Sequence[str], listening: socket.socket, count: int) -> None:
        """Remember what to start.

        :param words: command; `--fd NUMBER` of the listening socket is added
        """
        self._words = [*words, "--fd", str(listening.fileno())]
        self._listening = listening
        self._watching: list[asyncio.Task[None]] = []
        self._count = count
        self.pids: set[int] = set()

    async def start(self) -> None:
        """Start them all; back when each serves.

        :raises Refused: when one ends at once
        """
        ready = [asyncio.get_running_loop().create_future() for _ in range(self._count)]
        self._watching = [asyncio.create_task(self._keep(one)) for one in ready]
        try:
            await asyncio.gather(*ready)
        except Refused:
            await self.close()
            raise

    async def close(self) -> None:
        """End and reap them all."""
        for task in self._watching:
            task.cancel()
        await asyncio.gather(*self._watching, return_exceptions=True)

    async def _keep(self, ready: "asyncio.Future[None]") -> None:
        while True:
            process = await asyncio.create_subprocess_exec(
                *self._words, pass_fds=[self._listening.fileno()], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE
            )
            self.pids.add(process.pid)
            try:
                assert process.stdout is not None
                line = await process.stdout.readline()
                if line.startswith(b"READY"):
                    if not ready.done():
                        ready.set_result(None)
                elif not ready.done():
                    ready.set_exception(Refused("cannot serve: a process ended at once, see its messages above"))
                    return
                await process.wait()
                _log.warning("a serving process ended with status %s and is started again", process.returncode)
            finally:
                await _end(process)
                self.pids.discard(process.pid)
            await asyncio.sleep(RESTART)


async def _end(process: asyncio.subprocess.Process) -> None:
    if process.returncode is not None:
        return
    process.terminate()
    try:
        async with asyncio.timeout(END):
            await process.wait()
    except TimeoutError:
        process.kill()
        await process.wait()


def command(module: str, *options: object) -> list[str]:
    """Return the words that start one serving process."""
    return [sys.executable, "-m", "rapp_hop", module, *map(str, options), "--parent", str(os.getpid())]
