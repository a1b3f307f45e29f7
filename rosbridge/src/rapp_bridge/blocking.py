"""Threads for what blocks: questions to the ROS master, rospy's registrations, pictures."""

import asyncio
import logging
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

T = TypeVar("T")
_log = logging.getLogger(__name__)


class Blocking:
    """A few daemon threads; unlike an executor's they do not keep a process alive whose master does not answer."""

    def __init__(self, threads: int) -> None:
        self._work: queue.SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = queue.SimpleQueue()
        self._threads = [threading.Thread(target=self._serve, daemon=True) for _ in range(threads)]
        for thread in self._threads:
            thread.start()

    async def run(self, function: Callable[..., T], *words: Any) -> T:
        """Run `function(*words)` in one of the threads; raises what it raises."""
        return await asyncio.wrap_future(self._submit(lambda: function(*words)))

    def background(self, function: Callable[[], object], done: Callable[[], object]) -> None:
        """Run `function` in one of the threads, then `done` on the event loop; what goes wrong is logged."""
        loop = asyncio.get_running_loop()

        def finish(future: Future[Any]) -> None:
            if error := future.exception():
                _log.error("work in the background", exc_info=error)
            if not loop.is_closed():
                loop.call_soon_threadsafe(done)

        self._submit(function).add_done_callback(finish)

    def close(self) -> None:
        """End the threads that are idle; the others end with their work."""
        for _ in self._threads:
            self._work.put(None)

    def _submit(self, function: Callable[[], T]) -> "Future[T]":
        future: Future[T] = Future()
        self._work.put((future, function))
        return future

    def _serve(self) -> None:
        while (item := self._work.get()) is not None:
            future, function = item
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(function())
            except BaseException as error:  # noqa: BLE001 - it is raised where the result is awaited
                future.set_exception(error)
