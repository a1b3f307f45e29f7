"""The gate of one run, as its launcher sees it: a process that is started, told its rules, watched, ended and reaped."""

import contextlib
import logging
import os
import signal
import socket
import subprocess
import sys
import threading
import time

from rapp_core.errors import Bug, Invalid, Unreachable
from rapp_core.gate.rules import Rules
from rapp_core.launcher.channel import Channel
from rapp_ros.master import MasterAwayError, ask

OPENING = 2.0  # s for a gate to take its rules
ENDING = 1.0  # s for a gate to end by itself
SILENCE = 1.0  # s without a sign of life after which a gate stands still
WITHDRAWING = 0.5  # s for the ROS master to forget what a killed gate has told it

_log = logging.getLogger(__name__)


class Gate:
    """One gate."""

    def __init__(self, master: str, node: str, inside: socket.socket) -> None:
        """Start it. `master`: URI of the real one; `node`: what the run is called there; `inside`: over it come the sandbox's own
        sockets from the runner. Raises Bug.

        Call it from a thread that lives as long as this process: the gate ends with the thread that has started it.
        """
        self._master, self._node = master, node
        ours, theirs = socket.socketpair()
        words = ["--control", str(theirs.fileno()), "--inside", str(inside.fileno())]
        words += ["--master", master, "--node", node]
        try:
            with theirs:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "rapp_core.gate", *words],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    pass_fds=(theirs.fileno(), inside.fileno()),
                    start_new_session=True,
                    env={"PATH": os.environ.get("PATH", os.defpath), "LANG": "C.UTF-8", "MALLOC_ARENA_MAX": "2"},
                )
        except OSError as error:
            ours.close()
            raise Bug(f"cannot start a gate: {error}") from error
        self.beat = time.monotonic()
        """When its last sign of life came."""
        self._opened = threading.Event()
        self._api = ""  # its XMLRPC API towards the robot's nodes
        self._topics: list[str] = []  # that may be published there
        self._channel = Channel(ours)
        self._reader = threading.Thread(target=self._read, name=f"gate of {node}", daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether its process runs."""
        return self._process.poll() is None

    @property
    def answers(self) -> bool:
        """Whether it runs and has given signs of life of late."""
        return self.alive and time.monotonic() - self.beat < SILENCE

    def open(self, rules: Rules, secret: str) -> None:
        """Let the run use these names from now on; raises Unreachable."""
        self._topics = sorted(rules.publishes)
        self._channel.send(rules=rules.as_json(), secret=secret)
        if not self._opened.wait(OPENING):
            raise Unreachable("cannot open the gate: it does not answer")

    def end(self) -> None:
        """End and reap it; nothing of the run is left at the ROS master, if that answers."""
        answered = self.answers
        self._channel.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(ENDING if answered else 0)
        killed = self._process.returncode != 0
        if killed:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._withdraw()
        self._reader.join(1)

    def _withdraw(self) -> None:
        """Undo at the ROS master what the gate could not undo."""
        try:
            for topic in self._topics if self._api else ():
                ask(self._master, WITHDRAWING, "unregisterPublisher", self._node, topic, self._api)
        except MasterAwayError as error:
            _log.warning("%s: %s", self._node, error)

    def _read(self) -> None:
        with contextlib.suppress(Invalid):
            while (message := self._channel.receive()) is not None:
                self.beat = time.monotonic()
                if message["type"] == "opened":
                    self._opened.set()
                elif message["type"] == "api":
                    self._api = str(message["uri"])
