"""Worker processes for CPU-heavy work: each holds one object made by `setup` and runs its methods, one call at a time.

A call has a deadline; a worker that overruns it or dies is killed, reaped and replaced. Arguments and results are
pickled. Workers ignore SIGINT, for the parent ends them; they end by themselves when the parent is gone.
"""

import asyncio
import logging
import multiprocessing
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any

from rapp_hop.errors import Bug, Unreachable

_SPAWN = multiprocessing.get_context("spawn")
_log = logging.getLogger(__name__)


class Workers:
    """A fixed number of worker processes; start with `start()`, end with `close()`."""

    def __init__(self, setup: Callable[[], object], count: int) -> None:
        """Remember what to start.

        :param setup: a function of a module (pickled by name) that makes the object whose methods are called
        """
        self._setup = setup
        self._count = count
        self._free: asyncio.Queue[_Worker] = asyncio.Queue()
        self._all: set[_Worker] = set()
        self._closed = False

    async def start(self) -> None:
        """Start the processes; they set up in the background, so this returns at once."""
        for _ in range(self._count):
            await self._add()

    async def run(self, method: str, *arguments: Any, timeout: float) -> Any:
        """Call a method of the workers' object in a free worker.

        :param timeout: seconds, waiting for a worker included
        :raises Unreachable: out of time
        :raises Exception: whatever the method raised
        """
        try:
            async with asyncio.timeout(timeout):
                worker = await self._free.get()
                return await self._use(worker, method, arguments)
        except TimeoutError:
            raise Unreachable(f"cannot finish {method} within {timeout:g} s: try again later") from None

    async def close(self) -> None:
        """End and reap all workers."""
        self._closed = True
        await asyncio.gather(*(asyncio.to_thread(worker.end) for worker in list(self._all)))
        self._all.clear()

    async def _use(self, worker: "_Worker", method: str, arguments: tuple[Any, ...]) -> Any:
        answered = False
        call = asyncio.ensure_future(asyncio.to_thread(worker.call, method, arguments))
        try:
            good, value = await asyncio.shield(call)
            answered = True
        except (EOFError, OSError):
            raise Bug(f"cannot finish {method}: a worker process died") from None
        finally:
            if answered:
                self._free.put_nowait(worker)
            else:
                await self._replace(worker, call)
        if not good:
            raise value
        return value

    async def _replace(self, worker: "_Worker", call: asyncio.Future[Any]) -> None:
        self._all.discard(worker)
        await asyncio.to_thread(worker.end)  # cuts the pipe, which ends the thread that reads from it
        await asyncio.wait([call])
        if not call.cancelled():
            call.exception()
        if not self._closed:
            _log.warning("a worker process was replaced")
            await self._add()

    async def _add(self) -> None:
        worker = await asyncio.to_thread(_Worker, self._setup)
        self._all.add(worker)
        self._free.put_nowait(worker)


class _Worker:
    """One process and the pipe to it."""

    def __init__(self, setup: Callable[[], object]) -> None:
        self._pipe, far = _SPAWN.Pipe()
        self._process: SpawnProcess = _SPAWN.Process(target=_serve, args=(far, setup), daemon=True, name="hop-worker")
        self._process.start()
        far.close()

    def call(self, method: str, arguments: tuple[Any, ...]) -> tuple[bool, Any]:
        self._pipe.send((method, arguments))
        found: tuple[bool, Any] = self._pipe.recv()
        return found

    def end(self) -> None:
        self._process.kill()
        self._process.join(5)
        # The reading thread sees the end of the pipe as soon as the process is gone; only then may it be closed.


def _serve(pipe: Connection, setup: Callable[[], object]) -> None:
    """Run in the worker: set up, then answer calls until the pipe ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    subject = setup()
    while True:
        try:
            method, arguments = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer = (True, getattr(subject, method)(*arguments))
        except Exception as error:  # noqa: BLE001 (carried to the caller, who knows its type)
            answer = (False, error)
        pipe.send(answer)
