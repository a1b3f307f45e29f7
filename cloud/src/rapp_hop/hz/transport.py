"""Bytes of a store for a thread, fetched by the client of an asyncio loop within bounds of time."""

import asyncio
import concurrent.futures
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

from rapp_hop.client import HopClient
from rapp_hop.errors import Unreachable
from rapp_hop.hz.attacks import Attack
from rapp_hop.hz.tar import Limits
from rapp_hop.streaming import Progress, Writer

_Result = TypeVar("_Result")


@dataclass(frozen=True)
class DeliveryLimits:
    """Bounds of a delivery."""

    metadata_timeout: float = 10.0  # seconds per metadata file
    package_timeout: float = 120.0  # seconds per package
    slowest: float = 1024.0  # bytes per second on average over each `window`; less is slow retrieval
    window: float = 5.0  # seconds
    package: Limits = field(default_factory=Limits)
    quota: int = 0  # bytes of all RApps and downloads on the disk; 0: no bound


class LoopTransport:
    """Bytes for a thread, fetched by the client of a loop."""

    def __init__(self, client: HopClient, loop: asyncio.AbstractEventLoop, limits: DeliveryLimits) -> None:
        """Remember the parts."""
        self._client = client
        self._loop = loop
        self._limits = limits
        self._lock = threading.Lock()
        self._running: concurrent.futures.Future[int] | None = None
        self._cancelled = False

    def get(self, url: str, write: Writer, limit: int, on_progress: Progress | None, start: int = 0) -> None:
        """Fetch `url`; see `trust.Transport`."""
        timeout = self._limits.metadata_timeout if "/metadata/" in url else self._limits.package_timeout
        with self._lock:
            if self._cancelled:
                raise Unreachable(f"cannot fetch {url}: it was given up")
            work = self._watched(url, write, limit, timeout, on_progress, start)
            self._running = asyncio.run_coroutine_threadsafe(work, self._loop)
        try:
            self._running.result(timeout + 5)
        except concurrent.futures.CancelledError:
            raise Unreachable(f"cannot fetch {url}: it was given up") from None
        except TimeoutError:
            self._running.cancel()
            raise Unreachable(f"cannot fetch {url} within {timeout:g} s: try again later") from None

    async def _watched(self, url: str, write: Writer, limit: int, timeout: float, on_progress: Progress | None, start: int) -> int:
        """Fetch, and give up a line that is kept open by a trickle (Uptane's slow retrieval)."""
        count = before = 0

        def counted(piece: bytes) -> object:
            nonlocal count
            count += len(piece)
            return write(piece)

        work = asyncio.ensure_future(self._client.download(url, counted, limit, timeout, on_progress, start))
        try:
            while not (await asyncio.wait([work], timeout=self._limits.window))[0]:
                if 0 < count < before + self._limits.slowest * self._limits.window:
                    slow = Unreachable(f"cannot fetch {url}: {Attack.SLOW}, {count} bytes so far, try again later")
                    slow.reason = Attack.SLOW.value
                    raise slow
                before = count
            return work.result()
        finally:
            work.cancel()
            await asyncio.wait([work])

    def cancel(self) -> None:
        """End the fetch under way and refuse the next ones."""
        with self._lock:
            self._cancelled = True
            if self._running is not None:
                self._running.cancel()


async def in_thread(transport: LoopTransport, work: Callable[..., _Result], *arguments: Any) -> _Result:
    """Call in a thread what fetches by the transport.

    Cancelling ends the fetch and waits for the thread, so that nothing half done goes on.
    """
    task = asyncio.ensure_future(asyncio.to_thread(work, *arguments))
    try:
        return await asyncio.shield(task)
    except asyncio.CancelledError:
        transport.cancel()
        await asyncio.wait([task])
        task.exception()  # taken: the caller asked for the end, not for its reason
        raise
