"""One run of a dynamic agent: its process, its channel, and what it has said of itself."""

import contextlib
import logging
import os
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from typing import Any

from rapp_core.errors import Invalid, Unreachable
from rapp_core.launcher.channel import Channel
from rapp_core.launcher.sandbox import RunFolders

_log = logging.getLogger(__name__)
Told = Callable[[dict[str, Any]], None]


class Run:
    """A started process in its sandbox: first a warm spare, then, once activated, a dynamic agent. Used once."""

    def __init__(self, name: str, folders: RunFolders, process: "subprocess.Popen[bytes]", channel: Channel) -> None:
        self.name = name
        self.token = ""  # secret of the lease, set at activation
        self.folders = folders
        self.ready = threading.Event()
        self.first_word = threading.Event()
        self.gone = threading.Event()
        self.outcome: tuple[str, str] | None = None  # "done" or "failed", and why, once it has sent "terminate"
        self.heartbeat = time.monotonic()  # when the last heartbeat came
        self.progress = time.monotonic()  # when its own loop last moved
        self._count = -1
        self._process = process
        self._channel = channel
        self._told: Told | None = None
        self._reader = threading.Thread(target=self._read, name=f"channel {name}", daemon=True)
        self._reader.start()

    @property
    def alive(self) -> bool:
        """Whether its process runs."""
        return self._process.poll() is None

    def activate(self, token: str, entry: str, parameters: dict[str, Any], told: Told) -> None:
        """Turn the spare into the dynamic agent whose package lies in the package folder. Raises Unreachable."""
        self.token = token
        self._told = told
        self.heartbeat = self.progress = time.monotonic()
        self._channel.send(
            type="activate", run=self.name, token=token, package="/rapp/package", entry=entry, parameters=parameters
        )

    def dismantle(self, patience: float) -> bool:
        """Ask it to stop what it has started; gives whether it answered "gone" within `patience` s."""
        try:
            self._channel.send(type="dismantle")
        except Unreachable:
            return False
        deadline = time.monotonic() + patience
        while self.alive and not self.gone.is_set() and time.monotonic() < deadline:
            self.gone.wait(0.05)
        return self.gone.is_set()

    def end(self, patience: float) -> None:
        """End and reap the process: SIGTERM, after `patience` s SIGKILL of its group; then remove its folders."""
        if self.alive:
            self._signal(signal.SIGTERM)
        try:
            self._process.wait(patience)
        except subprocess.TimeoutExpired:
            self._signal(signal.SIGKILL)
            self._process.wait()
        self._channel.close()
        self._reader.join(1)
        shutil.rmtree(self.folders.root, ignore_errors=True)

    def _signal(self, number: signal.Signals) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, number)

    def _read(self) -> None:
        try:
            while (message := self._channel.receive()) is not None:
                self._take(message)
        except Invalid as error:
            _log.warning("run %s: %s; it is ended", self.name, error)
            self.outcome = ("failed", str(error))
        self.gone.set()

    def _take(self, message: dict[str, Any]) -> None:
        kind = message["type"]
        if kind == "heartbeat":
            self._beat(message.get("count"))
        elif kind == "ready":
            self.ready.set()
        elif kind == "first_word":
            self.first_word.set()
        elif kind == "gone":
            self.gone.set()
        elif kind == "terminate":
            self.outcome = (str(message.get("outcome")), str(message.get("detail", ""))[:500])
        if self._told is not None and kind in ("state", "first_word", "terminate", "gone"):
            self._told(message)

    def _beat(self, count: object) -> None:
        self.heartbeat = time.monotonic()
        if isinstance(count, int) and count > self._count:
            self._count = count
            self.progress = self.heartbeat
