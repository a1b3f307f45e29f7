"""Blocking work beside the loop, in daemon threads: at the end of the process nobody waits for them."""

import asyncio
import threading
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


async def in_thread(work: Callable[..., T], *arguments: Any) -> T:
    """Run `work` in a thread of its own and return what it returns, or raise what it raises.

    Cancelling stops the waiting, not the work: give blocking work a time limit of its own.
    """
    loop = asyncio.get_running_loop()
    done: asyncio.Future[T] = loop.create_future()

    def settle(future: Callable[[Any], None], value: object) -> None:
        if not done.done():
            future(value)

    def run() -> None:
        try:
            outcome = done.set_result, work(*arguments)
        except BaseException as error:  # noqa: BLE001 (handed to who waits)
            _tell(loop, settle, done.set_exception, error)
        else:
            _tell(loop, settle, *outcome)

    threading.Thread(target=run, name=getattr(work, "__name__", "work"), daemon=True).start()
    return await done


def _tell(loop: asyncio.AbstractEventLoop, *call: Any) -> None:
    if not loop.is_closed():
        try:
            loop.call_soon_threadsafe(*call)
        except RuntimeError:  # closed in between: the process ends
            return
