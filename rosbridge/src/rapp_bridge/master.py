"""Questions to the ROS master (wiki.ros.org/ROS/Master_API, wiki.ros.org/ROS/Parameter Server API)."""

from typing import Any
from urllib.parse import urlsplit

import rospy

from rapp_bridge.errors import Unreachable
from rapp_ros.master import MasterAwayError, ask

Entries = list[tuple[str, list[str]]]
"""Names and their nodes."""


class Unregistered(Unreachable):
    """The master knows no such service."""


class Master:
    """The ROS master. Its methods block, from any thread, up to `timeout` seconds, and raise Unreachable after that."""

    def __init__(self, uri: str, caller: str, timeout: float) -> None:
        self._uri = uri
        self._caller = caller
        self._timeout = timeout

    def service_address(self, name: str) -> tuple[str, int]:
        """Where a service listens; raises Unregistered when none of that name is."""
        code, _, uri = self._ask("lookupService", name)
        parts = urlsplit(str(uri))
        if code != 1 or parts.hostname is None or parts.port is None:
            raise Unregistered(f"cannot call {name}: no such service is registered; start its node")
        return parts.hostname, parts.port

    def topic_type(self, name: str) -> str | None:
        """The type of a topic; None when nobody publishes or subscribes it."""
        found = next((kind for topic, kind in self.topic_types() if topic == name and kind != "*"), None)
        if found is None:
            return None
        publishers, subscribers, _ = self.state()  # the master never forgets a type
        return found if any(topic == name for topic, _ in [*publishers, *subscribers]) else None

    def topic_types(self) -> list[tuple[str, str]]:
        """All topics that ever were, and their types; "*" when not known."""
        return [(str(topic), str(kind)) for topic, kind in self._ask("getTopicTypes")[2]]

    def subscribers(self, topic: str) -> set[str]:
        """Nodes that subscribe a topic."""
        return {node for name, nodes in self.state()[1] if name == topic for node in nodes}

    def state(self) -> tuple[Entries, Entries, Entries]:
        """Publishers, subscribers and services."""
        publishers, subscribers, services = self._ask("getSystemState")[2]
        return publishers, subscribers, services

    def param(self, question: str, *words: Any) -> tuple[bool, Any]:
        """Ask the parameter server; gives whether it could, and its answer."""
        code, _, value = self._ask(question, *words)
        return code == 1, value

    def _ask(self, question: str, *words: Any) -> tuple[int, str, Any]:
        try:
            return ask(self._uri, self._timeout, question, self._caller, *words)
        except MasterAwayError as error:
            raise Unreachable(str(error)) from error


def publishes(node: str, topic: str, seconds: float) -> tuple[str, int] | None:
    """Where the node of this URI publishes a topic by TCPROS; None when it does not. Raises Unreachable. Blocks.

    wiki.ros.org/ROS/Slave_API, requestTopic.
    """
    try:
        code, _, words = ask(node, seconds, "requestTopic", rospy.get_name(), topic, [["TCPROS"]])
    except MasterAwayError as error:
        raise Unreachable(str(error)) from error
    return (str(words[1]), int(words[2])) if code == 1 and words else None
