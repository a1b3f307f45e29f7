"""Runs services: on the loop, in a thread or in a worker process, within time; one slow service never delays another.

Each service has a lane of its own: so many places (`concurrency`), and as many threads or worker processes, which are
started when they are first needed. Callers wait for a place within their time; too many of them are turned away at once.
"""

import asyncio
import functools
import importlib
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from rapp_hop.errors import Unreachable
from rapp_hop.protocol import TURNED_AWAY
from rapp_hop.service import Service
from rapp_hop.workers import Workers

QUEUE = 64  # calls of one service that may wait for a place


class Runner:
    """The lanes of one server; `close()` lets them go."""

    def __init__(self) -> None:
        self._lanes: dict[str, _Lane] = {}

    async def warm(self, services: Iterable[Service]) -> None:
        """Start the first worker process of every heavy service, so that its first call need not wait for it."""
        await asyncio.gather(*(self._lane(item).start() for item in services if item.heavy))

    async def run(self, service: Service, arguments: Mapping[str, Any]) -> Any:
        """Run a service with bound arguments and return its result.

        :raises Unreachable: when it is busy (status 503) or takes longer than its time (status 408)
        """
        lane = self._lane(service)
        try:
            async with asyncio.timeout(service.timeout):
                await lane.enter()
                return await lane.work(arguments)
        except TimeoutError:
            raise Unreachable(f"cannot finish {service.name} within {service.timeout:g} s: try again later", 408) from None

    async def close(self) -> None:
        """Let the threads end with the calls they have, and end the worker processes."""
        lanes = list(self._lanes.values())
        self._lanes.clear()
        await asyncio.gather(*(lane.close() for lane in lanes))

    def _lane(self, service: Service) -> "_Lane":
        lane = self._lanes.get(service.name)
        if lane is None or lane.service.function is not service.function:
            lane = self._lanes[service.name] = _Lane(service)
        return lane


class _Lane:
    """The places of one service."""

    def __init__(self, service: Service) -> None:
        self.service = service
        self._places = asyncio.Semaphore(service.concurrency)
        self._waiting = 0
        self._threads: ThreadPoolExecutor | None = None
        self._workers: Workers | None = None

    async def start(self) -> None:
        if self._workers is None:
            self._workers = Workers(_make_caller, self.service.concurrency, first=1)
            await self._workers.start()

    async def enter(self) -> None:
        if self._waiting >= QUEUE:
            error = Unreachable(f"cannot call {self.service.name} now: too many calls wait for it, try again later", 503)
            error.reason = TURNED_AWAY
            raise error
        self._waiting += 1
        try:
            await self._places.acquire()
        finally:
            self._waiting -= 1

    async def work(self, arguments: Mapping[str, Any]) -> Any:
        if self.service.asynchronous or self.service.heavy:
            try:
                return await (self._in_worker(arguments) if self.service.heavy else self.service.function(**arguments))
            finally:
                self._places.release()
        return await self._in_thread(arguments)

    async def close(self) -> None:
        if self._threads is not None:
            self._threads.shutdown(wait=False, cancel_futures=True)
        if self._workers is not None:
            await self._workers.close()

    async def _in_worker(self, arguments: Mapping[str, Any]) -> Any:
        await self.start()
        assert self._workers is not None
        function = self.service.function
        return await self._workers.run(
            "call", function.__module__, function.__qualname__, dict(arguments), timeout=self.service.timeout
        )

    async def _in_thread(self, arguments: Mapping[str, Any]) -> Any:
        if self._threads is None:
            self._threads = ThreadPoolExecutor(self.service.concurrency, thread_name_prefix=f"hop-{self.service.name}")
        call = functools.partial(self.service.function, **arguments)
        work = asyncio.get_running_loop().run_in_executor(self._threads, call)
        # A thread cannot be ended: an overdue call keeps its place until it really ends.
        work.add_done_callback(self._ended)
        return await asyncio.shield(work)

    def _ended(self, work: asyncio.Future[Any]) -> None:
        self._places.release()
        if not work.cancelled():
            work.exception()  # taken, also when nobody waits for it any more


class Caller:
    """Lives in a worker process and calls heavy services by name."""

    def call(self, module: str, name: str, arguments: dict[str, Any]) -> Any:
        """Call a function, or the service that the decorator made of it."""
        found: Any = importlib.import_module(module)
        for word in name.split("."):
            found = getattr(found, word)
        return (found.function if isinstance(found, Service) else found)(**arguments)


def _make_caller() -> Caller:
    return Caller()
