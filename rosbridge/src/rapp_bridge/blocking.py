"""Threads for what blocks: questions to the ROS master and rospy's registrations."""

import asyncio
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

T = TypeVar("T")


class Blocking:
    """A few daemon threads; unlike an executor's they do not keep a process alive whose master does not answer."""

    def __init__(self, threads: int) -> None:
        self._work: queue.SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = queue.SimpleQueue()
        self._threads = [threading.Thread(target=self._serve, daemon=True) for _ in range(threads)]
        for thread in self._threads:
            thread.start()

    async def run(self, function: Callable[..., T], *words: Any) -> T:
        """Run `function(*words)` in one of the threads; raises what it raises."""
        future: Future[T] = Future()
        self._work.put((future, lambda: function(*words)))
        return await asyncio.wrap_future(future)

    def close(self) -> None:
        """End the threads that are idle; the others end with their work."""
        for _ in self._threads:
            self._work.put(None)

    def _serve(self) -> None:
        while (item := self._work.get()) is not None:
            future, function = item
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(function())
            except BaseException as error:  # noqa: BLE001 - it is raised where the result is awaited
                future.set_exception(error)
