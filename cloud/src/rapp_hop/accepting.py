"""Accepts connections one at a time, so that processes which share a listening socket share its callers evenly.

(Tornado's own accept handler takes all that wait at once, and one process would have them all.)
"""

import asyncio
import logging
import socket
from collections.abc import Callable
from typing import Any

from tornado.ioloop import IOLoop

PAUSE = 0.1  # seconds without accepting when the system has no descriptor left
_log = logging.getLogger(__name__)


class Door:
    """A listening socket that is served; `close()` ends that and the socket."""

    def __init__(self, listening: socket.socket, on_connection: Callable[[socket.socket, Any], None]) -> None:
        """Begin to accept; needs a running loop."""
        listening.setblocking(False)
        self._listening = listening
        self._on_connection = on_connection
        self._io_loop = IOLoop.current()
        self._pause: asyncio.TimerHandle | None = None
        self._open()

    def close(self) -> None:
        """Accept no more."""
        if self._pause is not None:
            self._pause.cancel()
        else:
            self._io_loop.remove_handler(self._listening)
        self._listening.close()

    def _open(self) -> None:
        self._pause = None
        self._io_loop.add_handler(self._listening, self._accept, IOLoop.READ)

    def _accept(self, _listening: Any, _events: int) -> None:
        try:
            connection, peer = self._listening.accept()
        except (BlockingIOError, ConnectionAbortedError):  # another process was quicker, or the caller has gone
            return
        except OSError as error:
            _log.error("cannot accept a connection: %s, once more in %g s", error.strerror, PAUSE)
            self._io_loop.remove_handler(self._listening)
            self._pause = asyncio.get_running_loop().call_later(PAUSE, self._open)
            return
        self._on_connection(connection, peer)
