"""A line between two processes of ours that a test can cut and bring back: a TCP relay in a thread of this process."""

import asyncio
import threading
from collections.abc import Coroutine
from contextlib import suppress
from typing import Any

LOOPBACK = "127.0.0.1"
PATIENCE = 20.0  # s
MOST = 2**20  # bytes read at once
Pair = tuple[asyncio.StreamReader, asyncio.StreamWriter]


class Line:
    """Relays connections from `port` to `beyond`; what goes wrong on the way is for a subclass to say."""

    def __init__(self, beyond: int) -> None:
        """Listen on a free port.

        :param beyond: port of the real server
        """
        self.beyond = beyond
        self.port = 0
        self._loop = asyncio.new_event_loop()
        self._server: asyncio.Server | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._loop.run_forever, name="line", daemon=True)
        self._thread.start()
        self.back()

    async def relay(self, client: Pair) -> None:
        """Serve one connection."""
        raise NotImplementedError

    def cut(self) -> None:
        """End all connections and take no new ones: who calls is refused."""
        self._wait(self._cut())

    def back(self) -> None:
        """Take connections again, on the same port."""
        self._wait(self._listen())

    def close(self) -> None:
        """End the relay and its thread."""
        self.cut()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(PATIENCE)
        self._loop.close()

    def _wait(self, work: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result(PATIENCE)

    async def _listen(self) -> None:
        if self._server is None:
            self._server = await asyncio.start_server(self._serve, LOOPBACK, self.port)
            self.port = self._server.sockets[0].getsockname()[1]

    async def _cut(self) -> None:
        server, self._server = self._server, None
        if server is not None:
            server.close()
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            with suppress(ConnectionError, asyncio.IncompleteReadError, asyncio.CancelledError):
                await self.relay((reader, writer))
        finally:
            self._tasks.discard(task)
            writer.close()
