"""The channel between core agent and dynamic agent: JSON objects, one per line, over a UNIX socket pair."""

import contextlib
import json
import socket
import threading
from typing import Any

from rapp_core.errors import Invalid, Unreachable

LONGEST = 64 * 1024  # bytes of one line
SEND_TIMEOUT = 1.0  # s; a dynamic agent that does not read is treated as gone


class Channel:
    """The core agent's end."""

    def __init__(self, end: socket.socket) -> None:
        self._socket = end
        self._lock = threading.Lock()
        self._rest = b""

    def send(self, **message: Any) -> None:
        """Send one message; raises Unreachable when the other end is gone or does not read."""
        line = json.dumps(message).encode() + b"\n"
        try:
            with self._lock:
                self._socket.settimeout(SEND_TIMEOUT)
                self._socket.sendall(line)
        except OSError as error:
            raise Unreachable(f"cannot tell the dynamic agent: {error}") from error

    def receive(self) -> dict[str, Any] | None:
        """Wait for the next message; None at the end of the channel. Raises Invalid for what is no message."""
        while b"\n" not in self._rest:
            if len(self._rest) > LONGEST:
                raise Invalid(f"the dynamic agent sent a line of more than {LONGEST} bytes")
            try:
                piece = self._socket.recv(LONGEST)
            except TimeoutError:
                continue
            except OSError:
                return None
            if not piece:
                return None
            self._rest += piece
        line, _, self._rest = self._rest.partition(b"\n")
        try:
            message = _whole(json.loads(line))
        except (ValueError, RecursionError) as error:
            raise Invalid("the dynamic agent sent a line that is no JSON") from error
        if not isinstance(message, dict) or not isinstance(message.get("type"), str):
            raise Invalid("the dynamic agent sent a message without a type")
        return message

    def close(self) -> None:
        """Close this end; a thread in `receive` wakes."""
        with contextlib.suppress(OSError):  # the other end may be gone already
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


def _whole(message: Any) -> Any:
    """The message with a question mark for each half of a character (a lone surrogate), which nobody could be sent."""
    return json.loads(json.dumps(message, ensure_ascii=False).encode("utf-8", "replace"))
