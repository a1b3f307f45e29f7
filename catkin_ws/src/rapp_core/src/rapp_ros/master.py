"""Questions to the ROS master that end in bounded time (wiki.ros.org/ROS/Master_API)."""

import http.client
import xmlrpc.client
from typing import Any


class MasterAwayError(Exception):
    """The master does not answer, or not in time."""


class _Timed(xmlrpc.client.Transport):
    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


def ask(uri: str, timeout: float, question: str, *words: Any) -> tuple[int, str, Any]:
    """Call one method of the master at `uri`; gives status code, text and value. Waits up to `timeout` s.

    Raises MasterAwayError.
    """
    try:
        with xmlrpc.client.ServerProxy(uri, transport=_Timed(timeout)) as server:
            code, text, value = getattr(server, question)(*words)
    except (OSError, http.client.HTTPException, xmlrpc.client.Error) as error:
        raise MasterAwayError(f"cannot ask the ROS master: {error}; see that roscore runs") from error
    return code, text, value
