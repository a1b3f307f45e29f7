"""Questions to the ROS master that end in bounded time."""

import http.client
import xmlrpc.client
from typing import Any
from urllib.parse import urlsplit

from rapp_bridge.errors import Unreachable


class _Timed(xmlrpc.client.Transport):
    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


class Master:
    """The ROS master's API, as far as the bridge needs it. Its methods block, from any thread, up to `timeout` seconds."""

    def __init__(self, uri: str, caller: str, timeout: float) -> None:
        self._uri = uri
        self._caller = caller
        self._timeout = timeout

    def service_address(self, name: str) -> tuple[str, int]:
        """Where a service listens; raises Unreachable when none of that name is registered."""
        code, _, uri = self._ask("lookupService", name)
        parts = urlsplit(str(uri))
        if code != 1 or parts.hostname is None or parts.port is None:
            raise Unreachable(f"cannot call {name}: no such service is registered; start its node")
        return parts.hostname, parts.port

    def topic_type(self, name: str) -> str | None:
        """The type of a topic; None when nobody publishes or subscribes it."""
        _, _, pairs = self._ask("getTopicTypes")
        found = next((str(kind) for topic, kind in pairs if topic == name and kind != "*"), None)
        if found is None:
            return None
        _, _, (publishers, subscribers, _) = self._ask("getSystemState")  # the master never forgets a type
        return found if any(topic == name for topic, _ in [*publishers, *subscribers]) else None

    def _ask(self, question: str, *words: str) -> tuple[int, str, Any]:
        try:
            with xmlrpc.client.ServerProxy(self._uri, transport=_Timed(self._timeout)) as server:
                code, text, value = getattr(server, question)(self._caller, *words)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error) as error:
            raise Unreachable(f"cannot ask the ROS master: {error}; see that roscore runs") from error
        return code, text, value
