"""One confined process of ours: first a warm spare, then, once activated, a cloud agent. Used once."""

import asyncio
import contextlib
import logging
import os
import shutil
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from rapp_cloud.cloud_agents.channel import Channel
from rapp_cloud.cloud_agents.confined import NEEDS, Confined
from rapp_cloud.cloud_agents.port import Order
from rapp_cloud.cloud_agents.sandbox import (
    INSIDE_PACKAGE,
    INSIDE_PLATFORM,
    INSIDE_PRIVATE,
    INSIDE_PYTHON,
    PLATFORM_SOCKET,
    Folders,
    Limits,
    command,
)
from rapp_cloud.cloud_agents.usage import Usage
from rapp_hop.errors import Bug, Invalid, Refused, Unreachable
from rapp_hop.protocol import WireAnswer, WireRequest
from rapp_hop.relay import relay

AGENT_SOCKET = "agent.socket"
BACKLOG = 64  # connections that wait to be taken
MESSAGES = 64, 4.0  # of an agent: at once, and each second; it sends one a second
NOTICE = 0.5  # s in which an end is seen that has cut a call

_TYPES = frozenset({"ready", "serving", "failed", "alive"})
_log = logging.getLogger(__name__)


class Closable(Protocol):
    """What `Serve` gives."""

    async def close(self) -> None:
        """End it."""


Serve = Callable[[str, frozenset[str], Path], Closable]
"""Serves, to one robot's cloud agent, those services of a_rep on a UNIX socket at a path."""


class LocalAgent:
    """See `port.CloudAgent`."""

    def __init__(self, folders: Folders, limits: Limits, process: Confined, channel: Channel, place: int) -> None:
        """Take what `start` has made."""
        self.folders = folders
        self.gone = False  # stopped, nothing is left of it
        self.process = process
        self.name = "spare"
        self._limits = limits
        self._channel = channel
        self._place = place  # the root folder: sockets are reached through it, for their paths may only have 107 bytes
        self._platform: Closable | None = None
        self._said: dict[str, asyncio.Future[dict[str, Any]]] = {}
        self._messages = 0  # since it began
        self._heard = self._begun = time.monotonic()
        self._excess = ""
        self._stopping: asyncio.Task[None] | None = None
        self._reader = asyncio.create_task(self._read())

    @classmethod
    async def start(cls, folders: Folders, limits: Limits) -> "LocalAgent":
        """Start a spare; it is not warm yet.

        :raises Refused: it cannot be confined here
        """
        folders.make()
        place = os.open(folders.root, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
        ours, theirs = socket.socketpair()
        try:
            with theirs, _listening(place) as listener:
                words = command(folders, limits, _environment(theirs.fileno(), listener.fileno()))
                process = await Confined.start(words, (theirs.fileno(), listener.fileno()), folders.log)
        except BaseException:
            ours.close()
            os.close(place)
            shutil.rmtree(folders.root, ignore_errors=True)
            raise
        return cls(folders, limits, process, await Channel.of(ours), place)

    @property
    def problem(self) -> str:
        """See `port.CloudAgent`."""
        now = time.monotonic()
        if not self.process.alive:
            return "it has crashed"
        if now - self._heard > self._limits.silence:
            return "it hangs"
        return "its time is over" if now - self._begun > self._limits.life else self._excess

    async def ready(self) -> None:
        """Wait until it is warm.

        :raises Refused: the sandbox ends before, so there is no confinement here
        :raises Unreachable: it takes too long
        """
        if await self._answer("ready") is None:
            raise Refused(f"cannot confine a cloud agent here: {self._last_words()}; {NEEDS}")

    async def activate(self, order: Order, serve: Serve) -> None:
        """Become the cloud agent whose package lies in the package folder; returns when it serves.

        :raises Bug: its program fails
        :raises Unreachable: it takes too long
        """
        self.name = order.name
        self._messages = 0
        self._heard = self._begun = time.monotonic()
        self._platform = serve(order.robot, order.services, Path(f"/proc/self/fd/{self._place}/platform/{PLATFORM_SOCKET}"))
        self._channel.send(
            type="activate", robot=order.robot, package=INSIDE_PACKAGE, entry=order.entry, parameters=dict(order.parameters)
        )
        answer = await self._answer("serving", "failed")
        if answer is None or answer["type"] == "failed":
            why = self._last_words() if answer is None else str(answer.get("message", ""))[:300]
            raise Bug(f"cannot start {order.name}: {why}")

    async def send(self, request: WireRequest, path: str, timeout: float) -> WireAnswer:
        """See `port.CloudAgent`."""
        try:
            return await relay(Path(f"/proc/self/fd/{self._place}/{AGENT_SOCKET}"), request, path, timeout)
        except Unreachable as error:
            await self.process.wait(NOTICE)
            if self.problem:
                raise Unreachable(f"cannot call {self.name}: {self.problem}") from None
            raise error

    def take(self, usage: Usage) -> None:
        """Look at what it uses."""
        if usage.memory > self._limits.memory:
            self._excess = "it takes too much memory"
        elif usage.cpu > self._limits.cpu:
            self._excess = "it takes too much processor time"

    async def stop(self) -> None:
        """See `port.CloudAgent`; what it printed is kept until the next one of its package ends."""
        if self._stopping is None:
            self._stopping = asyncio.create_task(self._stop())
        await asyncio.shield(self._stopping)

    async def _stop(self) -> None:
        await self.process.end(self._limits.terminate)
        self._reader.cancel()
        await asyncio.gather(self._reader, return_exceptions=True)
        await self._channel.close()
        if self._platform is not None:
            await self._platform.close()
        os.close(self._place)
        await asyncio.to_thread(_tidy, self.folders, self.name)
        self.gone = True

    async def _answer(self, *types: str) -> dict[str, Any] | None:
        """The next message of one of these types, and only the first of its type is seen; None when the process has ended."""
        said = [self._said.setdefault(kind, asyncio.get_running_loop().create_future()) for kind in types]
        ended = asyncio.create_task(self.process.wait(self._limits.start))
        try:
            waiting: list[asyncio.Future[Any]] = [*said, ended]
            await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        finally:
            ended.cancel()
        for future in said:
            if future.done():
                return future.result()
        if self.process.alive:
            raise Unreachable(f"cannot start {self.name}: it was not ready within {self._limits.start:g} s")
        return None

    async def _read(self) -> None:
        try:
            while (message := await self._channel.receive()) is not None:
                self._take_message(message)
        except Invalid as error:
            self._excess = f"its channel: {error}"

    def _take_message(self, message: dict[str, Any]) -> None:
        """Keep the first message of each known type. Raises Invalid."""
        self._heard = time.monotonic()
        self._messages += 1
        at_once, a_second = MESSAGES
        if message["type"] not in _TYPES or self._messages > at_once + a_second * (self._heard - self._begun):
            raise Invalid("it sent what no cloud agent says, or too many messages")
        if message["type"] == "alive":
            return
        future = self._said.setdefault(message["type"], asyncio.get_running_loop().create_future())
        if not future.done():
            future.set_result(message)

    def _last_words(self) -> str:
        text = self.folders.log.read_text(errors="replace")[-2000:] if self.folders.log.exists() else ""
        return (text.strip().splitlines() or ["it ended without a word"])[-1][:200]


def _environment(channel: int, listener: int) -> dict[str, str]:
    return {
        "RAPP_AGENT_CHANNEL": str(channel),
        "RAPP_AGENT_LISTENER": str(listener),
        "RAPP_AGENT_PLATFORM": f"{INSIDE_PLATFORM}/{PLATFORM_SOCKET}",
        "PYTHONPATH": INSIDE_PYTHON,
        "PYTHONDONTWRITEBYTECODE": "1",
        "HOME": INSIDE_PRIVATE,
        "TMPDIR": INSIDE_PRIVATE,
        "PATH": "/usr/bin:/bin",
        "LANG": "C.UTF-8",
        "MALLOC_ARENA_MAX": "2",  # each arena takes 64 MB of the limit on address space, whether used or not
    }


def _listening(place: int) -> socket.socket:
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        listener.bind(f"/proc/self/fd/{place}/{AGENT_SOCKET}")
        listener.listen(BACKLOG)
    except BaseException:
        listener.close()
        raise
    listener.setblocking(False)
    return listener


def _tidy(folders: Folders, name: str) -> None:
    with contextlib.suppress(OSError):  # a log that cannot be kept must not keep the folder
        kept = folders.root.parent.parent / "logs" / f"{name}.log"
        kept.parent.mkdir(exist_ok=True)
        folders.log.replace(kept)
    shutil.rmtree(folders.root, ignore_errors=True)
