"""The dynamic agent's end of its channel to the core agent: JSON objects, one per line, over a UNIX socket pair."""

import json
import logging
import socket
import threading
from collections.abc import Callable
from typing import Any, Protocol

LONGEST = 64 * 1024  # bytes of one line

_log = logging.getLogger(__name__)


class Channel(Protocol):
    """What a run needs of its channel. All methods are for any thread."""

    def send(self, **message: Any) -> None:
        """Send one message."""

    def receive(self) -> dict[str, Any] | None:
        """Wait for the next message; None when the core agent has closed the channel."""


class SocketChannel:
    """See `Channel`; `lost` is called when the core agent is gone, for a dynamic agent can do nothing without it."""

    def __init__(self, end: socket.socket, lost: Callable[[], None]) -> None:
        end.settimeout(None)  # rospy sets a default time-out for all sockets
        self._socket = end
        self._lines = end.makefile("rb")
        self._lock = threading.Lock()
        self._lost = lost

    def send(self, **message: Any) -> None:
        """See `Channel`."""
        line = json.dumps(message).encode() + b"\n"
        try:
            with self._lock:
                self._socket.sendall(line)
        except OSError:
            self._lost()

    def receive(self) -> dict[str, Any] | None:
        """See `Channel`; what is no message ends the channel too."""
        try:
            line = self._lines.readline(LONGEST)
            message = json.loads(line) if line else None
        except (OSError, ValueError) as error:
            _log.error("cannot understand the other end: %s", error)
            return None
        return message if isinstance(message, dict) and "type" in message else None
