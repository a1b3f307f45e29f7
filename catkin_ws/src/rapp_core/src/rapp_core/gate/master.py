"""The ROS master that a RApp's node sees, and the node that publishes what it hears (wiki.ros.org/ROS/Master_API, Slave_API).

It knows the permitted names only. A service that is not permitted is answered with an address too: the connection then says why
it is refused, which a ROS client shows, while it waits in silence for a service that the master does not know.
"""

import logging
from collections.abc import Awaitable, Callable
from typing import Any
from urllib.parse import urlsplit

from rapp_core.errors import Unreachable
from rapp_core.gate.inside import LOOPBACK
from rapp_core.gate.questions import Outcome
from rapp_core.gate.rules import Rules
from rapp_core.gate.upstream import Upstream

PARAMETERS = {"/use_sim_time": False, "/tcp_keepalive": True}  # what rospy asks for when a node begins
SILENT = frozenset({"/rosout"})  # may be published to, and goes nowhere: a RApp prints into its own log

_log = logging.getLogger(__name__)


class Master:
    """Answers the calls of the nodes inside. `rules` and `publish_api` change once, when the spare becomes a RApp."""

    def __init__(self, upstream: Upstream, uri: str, relay: int) -> None:
        """`uri`: of this master as seen inside; `relay`: port where connections are relayed, inside."""
        self.rules = Rules()
        self.publishers: dict[str, int] = {}
        """Topics that a node inside publishes, with the port of its XMLRPC API."""
        self.publish_api: Callable[[], Awaitable[str]] | None = None
        """Opens the gate's own XMLRPC API towards the robot's nodes, and gives its URI."""
        self._upstream, self._uri, self._relay = upstream, uri, relay
        self._methods: dict[str, Callable[..., Awaitable[Outcome]]] = {
            "registerPublisher": self._register_publisher,
            "unregisterPublisher": self._unregister_publisher,
            "registerSubscriber": self._register_subscriber,
            "unregisterSubscriber": self._done,
            "registerService": self._register_service,
            "unregisterService": self._done,
            "lookupService": self._lookup_service,
            "requestTopic": self._request_topic,
            "getPublishedTopics": self._topics,
            "getTopicTypes": self._topics,
            "getSystemState": self._state,
            "getUri": self._get_uri,
            "getPid": self._done,
            "getParam": self._get_param,
            "hasParam": self._has_param,
            "subscribeParam": self._subscribe_param,
            "unsubscribeParam": self._done,
            "getParamNames": self._param_names,
        }

    async def answer(self, method: str, words: list[Any]) -> Outcome:
        """See `questions.Answerer`. Raises Unreachable when the robot's master is away: a node then tries again."""
        answerer = self._methods.get(method)
        if answerer is None or not words or not isinstance(words[0], str):
            return self.refuse(f"refused: cannot {method}: a RApp may not")
        try:
            return await answerer(*words)
        except TypeError:
            return -1, f"cannot {method}: these are not its words", 0

    def refuse(self, text: str) -> Outcome:
        """An answer that something is not allowed; noted in the log."""
        _log.warning("%s", text)
        return -1, text, 0

    async def _register_publisher(self, _caller: str, topic: str, _kind: str, api: str) -> Outcome:
        """The RApp publishes; towards the robot's master that is the gate, with the core agent's type."""
        if topic in SILENT:
            return 1, "", []
        port = _port(api)
        refusal = self.rules.publish(topic)
        if refusal or port is None or self.publish_api is None:
            return self.refuse(refusal or f"cannot publish {topic}: {api!r} is no address")
        self.publishers[topic] = port
        await self._upstream.register(topic, self.rules.publishes[topic], await self.publish_api())
        return 1, "", []

    async def _unregister_publisher(self, _caller: str, topic: str, _api: str) -> Outcome:
        if self.publishers.pop(topic, None) is None or self.publish_api is None:
            return 1, "", 0
        await self._upstream.unregister(topic, await self.publish_api())
        return 1, "", 1

    async def _register_subscriber(self, _caller: str, topic: str, _kind: str, _api: str) -> Outcome:
        refusal = self.rules.subscribe(topic)
        return self.refuse(refusal) if refusal else (1, "", [self._uri])

    async def _register_service(self, caller: str, name: str, _service: str, _api: str) -> Outcome:
        """A node's own services, such as those of its log's level, stay inside."""
        if name.startswith(caller + "/"):
            return 1, "", 1
        return self.refuse(f"refused: cannot offer {name}: a RApp offers no services")

    async def _lookup_service(self, _caller: str, name: str) -> Outcome:
        try:
            if not self.rules.service(name):
                await self._upstream.service(name)
        except Unreachable as error:
            return -1, str(error), 0
        return 1, "", f"rosrpc://{LOOPBACK}:{self._relay}"

    async def _request_topic(self, _caller: str, topic: str, _protocols: list[Any]) -> Outcome:
        refusal = self.rules.subscribe(topic)
        return self.refuse(refusal) if refusal else (1, "", ["TCPROS", LOOPBACK, self._relay])

    async def _topics(self, _caller: str, _namespace: str = "") -> Outcome:
        return 1, "", [[topic, kind] for topic, kind in self.rules.publishes.items()]

    async def _state(self, _caller: str) -> Outcome:
        return 1, "", [[], [], []]

    async def _get_uri(self, _caller: str) -> Outcome:
        return 1, "", self._uri

    async def _done(self, _caller: str, *_words: Any) -> Outcome:
        return 1, "", 1

    async def _get_param(self, _caller: str, name: str) -> Outcome:
        if name in PARAMETERS:
            return 1, "", PARAMETERS[name]
        return -1, f"cannot read {name}: a RApp's parameters are in its package.json", 0

    async def _has_param(self, _caller: str, name: str) -> Outcome:
        return 1, name, name in PARAMETERS

    async def _subscribe_param(self, _caller: str, _api: str, name: str) -> Outcome:
        return 1, "", PARAMETERS.get(name, {})

    async def _param_names(self, _caller: str) -> Outcome:
        return 1, "", list(PARAMETERS)


def _port(api: str) -> int | None:
    """Port of an address that a node inside gives; its host does not matter."""
    try:
        return urlsplit(api).port
    except (ValueError, AttributeError):
        return None
