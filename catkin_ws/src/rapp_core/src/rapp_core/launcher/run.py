"""One run of a dynamic agent: its process, its channel, and what it has said of itself."""

import logging
import shutil
import threading
import time
from pathlib import Path
from typing import Any

from rapp_core.errors import Invalid, Unreachable
from rapp_core.gate.rules import Rules
from rapp_core.launcher.channel import Channel
from rapp_core.launcher.confined import Confined
from rapp_core.launcher.gate import Gate
from rapp_core.launcher.sandbox import RunFolders
from rapp_core.manifest import Manifest
from rapp_core.ports import INSIDE_PACKAGE, Signal, Told

_log = logging.getLogger(__name__)
STEP = 0.05  # s between two looks
LEAVING = 1.0  # s for a dynamic agent that has said "gone" to leave ROS and end by itself


class Run:
    """A started process in its sandbox: first a warm spare, then, once activated, a dynamic agent. Used once."""

    def __init__(self, name: str, folders: RunFolders, process: Confined, channel: Channel, gate: Gate) -> None:
        self.name = name
        self.token = ""  # secret of the lease, set at activation
        self.manifest: Manifest | None = None  # of the RApp, set at activation
        self.folders = folders
        self.ready = threading.Event()
        self.first_word = threading.Event()
        self.gone = threading.Event()
        self.outcome: tuple[str, str] | None = None  # "done" or "failed", and why, once it has sent "terminate"
        self._beat_at = time.monotonic()  # when the last heartbeat came
        self.progress = time.monotonic()  # when its own loop last moved
        self.waits = False  # whether its own loop waits for a core service
        self._count = -1
        self._process = process
        self._channel = channel
        self._gate = gate
        self._told: Told | None = None
        self._reader = threading.Thread(target=self._read, name=f"channel {name}", daemon=True)
        self._reader.start()

    @property
    def package(self) -> Path:
        """See `ports.Agent`."""
        return self.folders.package

    @property
    def recordings(self) -> Path:
        """See `ports.Agent`."""
        return self.folders.recordings

    @property
    def alive(self) -> bool:
        """Whether its process and its gate run."""
        return self._process.alive and self._gate.alive

    @property
    def usable(self) -> bool:
        """Whether, as a spare, it can still become a dynamic agent."""
        return self._process.alive and self._gate.answers

    @property
    def heartbeat(self) -> float:
        """When the last sign of life of both came: without its gate a dynamic agent can do nothing."""
        return min(self._beat_at, self._gate.beat)

    @property
    def status(self) -> int | None:
        """Exit status of its process; None while it runs."""
        return self._process.status

    def wait_ready(self, seconds: float) -> bool:
        """Wait for the spare to be warm; gives whether it is. Returns early when it has died."""
        deadline = time.monotonic() + seconds
        while not self.ready.wait(STEP) and self.alive and time.monotonic() < deadline:
            pass
        return self.ready.is_set() and self.alive

    def activate(self, token: str, manifest: Manifest, rules: Rules, told: Told) -> None:
        """Turn the spare into the dynamic agent whose package lies in the package folder. Raises Unreachable.

        The lease's secret goes to the gate, never to the RApp.
        """
        self.token = token
        self.manifest = manifest
        self._told = told
        self._gate.open(rules, token)
        self._beat_at = self.progress = time.monotonic()
        told({"type": "activate"})  # before it is sent: what comes back is told by another thread
        self._channel.send(
            type="activate",
            run=self.name,
            package=INSIDE_PACKAGE,
            entry=manifest.entry,
            runtime=manifest.runtime,
            parameters=manifest.parameters,
            cloud_agent=manifest.partner is not None,
        )

    def dismantle(self, patience: float, hurry: Signal) -> bool:
        """Ask it to stop what it has started; gives whether it answered "gone" within `patience` s, or before `hurry`."""
        try:
            self._channel.send(type="dismantle")
        except Unreachable:
            return False
        deadline = time.monotonic() + patience
        while self.alive and not self.gone.is_set() and not hurry.is_set() and time.monotonic() < deadline:
            self.gone.wait(STEP)
        return self.gone.is_set()

    def end(self, patience: float, keep_log: Path | None = None) -> None:
        """End and reap all its processes: SIGTERM, after `patience` s SIGKILL; then remove its folders."""
        if self.gone.is_set():
            self._process.wait(LEAVING)
        if not self._gate.answers:
            self._gate.end()  # before the farewell to ROS that would wait for it
        self._process.end(patience)
        self._gate.end()
        self._channel.close()
        self._reader.join(1)
        if keep_log is not None and self.folders.log.exists():
            keep_log.parent.mkdir(parents=True, exist_ok=True)
            self.folders.log.replace(keep_log)
        shutil.rmtree(self.folders.root, ignore_errors=True)

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
            self._beat(message.get("count"), message.get("waits"))
        elif kind == "ready":
            self.ready.set()
        elif kind == "first_word":
            self.first_word.set()
        elif kind == "terminate" and self.outcome is None:
            self.outcome = (str(message.get("outcome")), str(message.get("detail", ""))[:500])
        if self._told is not None and kind in ("state", "first_word", "terminate", "gone"):
            self._told(message)
        if kind == "gone":
            self.gone.set()

    def _beat(self, count: object, waits: object) -> None:
        self._beat_at = time.monotonic()
        self.waits = waits is True
        if isinstance(count, int) and count > self._count:
            self._count = count
            self.progress = self._beat_at
