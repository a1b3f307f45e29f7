"""One child process: started, waited for, ended, reaped. Its READY line is read, all else it writes is kept in a log file."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

STEP = 0.05  # s between two looks


class ChildError(Exception):
    """A child did not start; the text holds the end of its log."""


class Child:
    """A process with a process group of its own; it is told to end when this process dies."""

    def __init__(self, name: str, words: Sequence[str], env: Mapping[str, str], log: Path) -> None:
        """Start it. Raises ChildError when its program cannot be executed."""
        self.name = name
        self._log = log
        self._ready: dict[str, Any] | None = None
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("wb") as errors:
            try:
                self._process = subprocess.Popen(
                    ["setpriv", "--pdeathsig", "TERM", *words],
                    env=dict(env),
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=errors,
                    start_new_session=True,
                )
            except OSError as error:
                raise ChildError(f"cannot start {name}: {error}") from error
        self._reader = threading.Thread(target=self._read, name=f"output of {name}", daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as lines, self._log.open("ab", buffering=0) as log:
            for line in lines:
                log.write(line)
                if line.startswith(b"READY ") and self._ready is None:
                    self._ready = json.loads(line[6:])

    @property
    def status(self) -> int | None:
        """Exit status; None while it runs."""
        return self._process.poll()

    def wait_ready(self, seconds: float, stop: threading.Event) -> dict[str, Any]:
        """Wait for its READY line; gives what that says. Raises ChildError when it ends, is late, or `stop` is set."""
        deadline = time.monotonic() + seconds
        while self._ready is None:
            self._still_starting(deadline, stop)
            stop.wait(STEP)
        return self._ready

    def wait_port(self, port: int, seconds: float, stop: threading.Event) -> None:
        """Wait until it listens on a port of this computer: for programs without a READY line. Raises ChildError."""
        deadline = time.monotonic() + seconds
        while True:
            with socket.socket() as probe:
                probe.settimeout(1.0)
                if probe.connect_ex(("127.0.0.1", port)) == 0:
                    return
            self._still_starting(deadline, stop)
            stop.wait(STEP)

    def _still_starting(self, deadline: float, stop: threading.Event) -> None:
        if self.status is not None:
            raise ChildError(f"cannot start {self.name}: it ended with status {self.status}\n{self.tail()}")
        if stop.is_set():
            raise ChildError(f"cannot start {self.name}: told to end meanwhile")
        if time.monotonic() > deadline:
            raise ChildError(f"cannot start {self.name}: it is not ready in time\n{self.tail()}")

    def tail(self, lines: int = 15) -> str:
        """The end of its log."""
        return "\n".join([f"--- {self._log}", *self._log.read_text(errors="replace").splitlines()[-lines:]])

    def end(self, patience: float) -> None:
        """SIGTERM, after `patience` s SIGKILL to its group; returns when it is reaped."""
        if self.status is None:
            self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(patience)
        except subprocess.TimeoutExpired:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
        self._reader.join(1)
