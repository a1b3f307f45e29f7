"""Runs services: on the loop or in a thread, within time, and so that one slow service never delays another.

Each service has its own places (`concurrency`); the pool has as many threads as there are places, so a free place always
finds a free thread. Callers wait for a place within their time; too many of them are turned away at once.
"""

import asyncio
import functools
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from rapp_hop.errors import Unreachable
from rapp_hop.service import Service, ServiceRegistry

QUEUE = 64  # calls of one service that may wait for a place


class Runner:
    """The threads of one server; `close()` lets them go."""

    def __init__(self, registry: ServiceRegistry) -> None:
        services = list(registry)
        self._places = {item.name: asyncio.Semaphore(item.concurrency) for item in services}
        self._waiting = dict.fromkeys(self._places, 0)
        threads = sum(item.concurrency for item in services if not item.asynchronous)
        self._threads = ThreadPoolExecutor(max(threads, 1), thread_name_prefix="hop")
        self._abandoned: set[asyncio.Future[Any]] = set()

    async def run(self, service: Service, arguments: Mapping[str, Any]) -> Any:
        """Run a service with bound arguments and return its result.

        :raises Unreachable: when it is busy (status 503) or takes longer than its time (status 408)
        """
        if self._waiting[service.name] >= QUEUE:
            raise Unreachable(f"cannot call {service.name} now: too many calls wait for it, try again later", 503)
        try:
            async with asyncio.timeout(service.timeout):
                await self._place(service)
                work = self._start(service, arguments)
                return await (work if service.asynchronous else asyncio.shield(work))
        except TimeoutError:
            raise Unreachable(f"cannot finish {service.name} within {service.timeout:g} s: try again later", 408) from None

    def close(self) -> None:
        """Let the threads end with the calls they have."""
        self._threads.shutdown(wait=False, cancel_futures=True)

    async def _place(self, service: Service) -> None:
        self._waiting[service.name] += 1
        try:
            await self._places[service.name].acquire()
        finally:
            self._waiting[service.name] -= 1

    def _start(self, service: Service, arguments: Mapping[str, Any]) -> asyncio.Future[Any]:
        if service.asynchronous:
            work: asyncio.Future[Any] = asyncio.ensure_future(service.function(**arguments))
        else:
            call = functools.partial(service.function, **arguments)
            work = asyncio.get_running_loop().run_in_executor(self._threads, call)
        # A thread cannot be ended: an overdue call keeps its place until it really ends.
        self._abandoned.add(work)
        work.add_done_callback(functools.partial(self._ended, service.name))
        return work

    def _ended(self, name: str, work: asyncio.Future[Any]) -> None:
        self._abandoned.discard(work)
        self._places[name].release()
        if not work.cancelled():
            work.exception()  # taken, also when nobody waits for it any more
