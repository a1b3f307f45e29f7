"""Worker processes for CPU-heavy work: each holds one object made by `setup` and runs its methods, one call at a time.
They are started all at once, or one after another as they are needed.

A call has a deadline; a worker that overruns it or dies is killed, reaped and replaced. Arguments and results are
pickled. A worker ends by itself when the parent is gone. (Not `multiprocessing`: its resource tracker is a process
that outlives us.)
"""

import asyncio
import logging
import socket
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from typing import Any

from rapp_hop.errors import Bug, Unreachable

_log = logging.getLogger(__name__)


class Workers:
    """Worker processes; start with `start()`, end with `close()`."""

    def __init__(self, setup: Callable[..., object], count: int, first: int | None = None, arguments: tuple[Any, ...] = ()) -> None:
        """Remember what to start.

        :param setup: a function of an importable module that makes the object whose methods are called
        :param count: processes at most
        :param first: how many of them start at once, all when None; the others when no free one is left
        :param arguments: of `setup`
        """
        self._setup = setup
        self._arguments = arguments
        self._count = count
        self._first = count if first is None else min(first, count)
        self._starting: set[asyncio.Task[None]] = set()
        self._threads = ThreadPoolExecutor(count, thread_name_prefix="worker-pipe")  # each waits for one worker's answer
        self._free: asyncio.Queue[_Worker] = asyncio.Queue()
        self._all: set[_Worker] = set()
        self._closed = False

    async def start(self) -> None:
        """Start the processes; they set up in the background, so this returns at once."""
        for _ in range(self._first):
            await self._add()

    async def run(self, method: str, *arguments: Any, timeout: float) -> Any:
        """Call a method of the workers' object in a free worker.

        :param timeout: seconds, waiting for a worker included
        :raises Unreachable: out of time
        :raises Exception: whatever the method raised
        """
        try:
            async with asyncio.timeout(timeout):
                if self._free.empty() and len(self._all) + len(self._starting) < self._count:
                    await self._add()
                worker = await self._free.get()
                return await self._use(worker, method, arguments)
        except TimeoutError:
            raise Unreachable(f"cannot finish {method} within {timeout:g} s: try again later") from None

    async def close(self) -> None:
        """End and reap all workers."""
        self._closed = True
        await asyncio.gather(*self._starting, return_exceptions=True)
        await asyncio.gather(*(asyncio.to_thread(worker.end) for worker in list(self._all)))
        self._all.clear()
        self._threads.shutdown(wait=False)

    async def _use(self, worker: "_Worker", method: str, arguments: tuple[Any, ...]) -> Any:
        answered = False
        call = asyncio.get_running_loop().run_in_executor(self._threads, worker.call, method, arguments)
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
        # A task of its own: who waits for it may be cancelled, the process that was begun must be known all the same.
        task = asyncio.get_running_loop().create_task(self._begin())
        self._starting.add(task)
        task.add_done_callback(self._starting.discard)
        await asyncio.shield(task)

    async def _begin(self) -> None:
        worker = await asyncio.to_thread(_Worker, self._setup, self._arguments)
        self._all.add(worker)
        self._free.put_nowait(worker)


class _Worker:
    """One process and the pipe to it."""

    def __init__(self, setup: Callable[..., object], arguments: tuple[Any, ...]) -> None:
        near, far = socket.socketpair()
        with far:
            words = [sys.executable, "-m", "rapp_hop.worker", str(far.fileno())]
            # A session of its own: Ctrl-C at the terminal is for the parent, who ends its workers.
            self._process = subprocess.Popen(
                words, pass_fds=[far.fileno()], stdin=subprocess.DEVNULL, stdout=2, start_new_session=True
            )
        self._pipe = Connection(near.detach())
        self._pipe.send((sys.path, setup.__module__, setup.__qualname__, arguments))

    def call(self, method: str, arguments: tuple[Any, ...]) -> tuple[bool, Any]:
        self._pipe.send((method, arguments))
        found: tuple[bool, Any] = self._pipe.recv()
        return found

    def end(self) -> None:
        # A thread that reads sees the end of the pipe as soon as the process is gone; the pipe itself is closed when
        # nobody holds it any more, never under a reader.
        self._process.kill()
        self._process.wait(5)
