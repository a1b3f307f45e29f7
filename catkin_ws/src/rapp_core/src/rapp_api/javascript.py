"""A RApp in JavaScript (DESIGN section 3.6): node runs it, and a rosbridge of its own, in the same sandbox, is its way to ROS.

The core agent's end of the channel stays here, so that a RApp whose event loop hangs is told from one that is gone: the heartbeat
goes on, and its count is that of node's event loop.
"""

import logging
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from rapp_api.channel import Channel, SocketChannel
from rapp_api.life import LONGEST_DETAIL, Bounds

RUNTIME = "javascript"  # in package.json
NODE = "/usr/bin/node"
LIBRARIES = "/usr/share/nodejs"  # where Debian puts packages for node
RUNNER = "/rapp/node_modules/rapp_api/runner.js"  # inside the sandbox
PORT = 9090  # of rosbridge, where every client looks for it
LONGEST_CALL = 3600  # s; longer than any service takes
LARGEST_FRAME = 32 << 20  # bytes; the files of one call, as text
ANY_SERVICE = "rapp_msgs/Say"  # loads those of its package with it
BACKLOG = 16
LEAVING = 1.0  # s for node to end once its end of the channel is closed
PASSED_ON: Mapping[str, tuple[str, ...]] = {
    "first_word": ("name",),
    "state": ("machine", "state", "kind", "detail"),
    "terminate": ("outcome", "detail"),
}
"""What node's side tells the core agent, and the texts in it."""

_log = logging.getLogger(__name__)


class Engine:
    """rosbridge and node, idle until they are told what to be; whoever connects before rosbridge is there waits at its listener."""

    def __init__(self) -> None:
        """Start both."""
        with socket.create_server(("127.0.0.1", PORT), backlog=BACKLOG) as listener:
            words = ["--guest", "--listener", str(listener.fileno())]
            words += ["--call-timeout", str(LONGEST_CALL), "--frame-limit", str(LARGEST_FRAME), "--service-type", ANY_SERVICE]
            self._bridge = subprocess.Popen([sys.executable, "-m", "rapp_bridge", *words], pass_fds=[listener.fileno()])
        ours, theirs = socket.socketpair()
        with theirs:
            environment = {**os.environ, "NODE_PATH": LIBRARIES, "RAPP_CHANNEL_FD": str(theirs.fileno())}
            try:
                self._program = subprocess.Popen([NODE, RUNNER], pass_fds=[theirs.fileno()], env=environment)
            except OSError:
                ours.close()
                _kill(self._bridge)
                raise
        self.channel = SocketChannel(ours, lambda: None)
        """To node's side."""

    @property
    def alive(self) -> bool:
        """Whether both run."""
        return self._bridge.poll() is None and self._program.poll() is None

    def end(self) -> None:
        """End and reap both."""
        _kill(self._bridge)
        _kill(self._program)

    def death(self) -> int:
        """The exit status, never 0, of a program that has closed its channel, or broken it."""
        with suppress(subprocess.TimeoutExpired):
            self._program.wait(LEAVING)
        if self._program.poll() is None:
            self._program.kill()
        status = self._program.wait()
        return status if status > 0 else 128 - status


def _kill(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()


def warm_up(wanted: str) -> Engine | None:
    """The engine, started ahead, when `wanted` is this language; without it this process can still be any other RApp."""
    try:
        return Engine() if wanted == RUNTIME else None
    except OSError as error:
        _log.error("cannot keep node warm: %s", error)
        return None


def live(channel: Channel, order: dict[str, Any], lost: Callable[[], None], bounds: Bounds, engine: Engine) -> int:
    """Be the RApp that the "activate" message names; gives 0 once "gone" is said, else the exit status of a program that died.

    `lost` is called, in a thread of its own, when the core agent closes the channel before that.
    """
    over, count = threading.Event(), _Count()
    inner = engine.channel
    inner.send(**order, bridge=f"ws://127.0.0.1:{PORT}")

    def obey() -> None:
        while (message := channel.receive()) is not None:
            inner.send(**message)
        if not over.is_set():
            lost()

    def beat() -> None:
        while not over.is_set():
            channel.send(type="heartbeat", count=count.value, waits=False)
            over.wait(bounds.heartbeat)

    for work in (obey, beat):
        threading.Thread(target=work, name=work.__name__, daemon=True).start()
    gone = _pass_on(inner, channel, count)
    over.set()
    if not gone:
        return engine.death()
    channel.send(type="gone")
    return 0


@dataclass
class _Count:
    """How often node's event loop has turned, as it tells."""

    value: int = 0


def _pass_on(inner: Channel, channel: Channel, count: _Count) -> bool:
    """Pass on what node's side tells until it has gone; False when it has ended without saying so."""
    while (message := inner.receive()) is not None:
        kind = message["type"]
        if kind == "gone":
            return True
        if kind == "heartbeat":
            count.value += 1
        elif kind in PASSED_ON:
            channel.send(type=kind, **{name: str(message.get(name, ""))[:LONGEST_DETAIL] for name in PASSED_ON[kind]})
    return False
