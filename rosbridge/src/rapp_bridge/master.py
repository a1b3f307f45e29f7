"""Questions to the ROS master, as far as the bridge has any."""

from typing import Any
from urllib.parse import urlsplit

from rapp_bridge.errors import Unreachable
from rapp_ros.master import MasterAwayError, ask


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
            return ask(self._uri, self._timeout, question, self._caller, *words)
        except MasterAwayError as error:
            raise Unreachable(str(error)) from error
