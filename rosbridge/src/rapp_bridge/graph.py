"""What there is in the ROS graph: nodes, topics, services, parameters, as one client may see them."""

import asyncio
import time
from collections.abc import Sequence
from typing import Any

from rapp_bridge.access import Access, matches
from rapp_bridge.blocking import Blocking
from rapp_bridge.config import Config
from rapp_bridge.errors import BridgeError
from rapp_bridge.links import Outgoing
from rapp_bridge.master import Entries, Master
from rapp_bridge.offers import Offers

ACTION_TOPICS = ("goal", "cancel", "status", "feedback", "result")
ANY = ("*",)


class Graph:
    """Asks the master, and nodes for the types of their services: a node that does not answer delays no answer for long."""

    def __init__(self, config: Config, master: Master, blocking: Blocking, offers: Offers, caller: str) -> None:
        self._config = config
        self._offers = offers
        self._master = master
        self._blocking = blocking
        self._caller = caller
        self._types: dict[tuple[str, tuple[str, int]], tuple[str, float]] = {}  # of services, and when they were asked

    async def topics(self, access: Access) -> dict[str, str]:
        """Topics that somebody publishes or subscribes, and their types ("" when not known)."""
        publishers, subscribers, _ = await self._state(access)
        types = dict(await self._blocking.run(self._master.topic_types))
        return {name: types.get(name, "").replace("*", "") for name in {**publishers, **subscribers}}

    async def publishers(self, topic: str, access: Access) -> list[str]:
        """Nodes that publish a topic."""
        return (await self._state(access))[0].get(topic, [])

    async def subscribers(self, topic: str, access: Access) -> list[str]:
        """Nodes that subscribe a topic."""
        return (await self._state(access))[1].get(topic, [])

    async def services(self, access: Access) -> list[str]:
        """Names of services."""
        return list((await self._state(access))[2])

    async def service_nodes(self, service: str, access: Access) -> list[str]:
        """Nodes that provide a service: one, or none."""
        return (await self._state(access))[2].get(service, [])

    async def services_of_type(self, kind: str, access: Access) -> dict[str, list[str]]:
        """Services of a type and their nodes; those that do not answer in time are left out."""
        services = (await self._state(access))[2]
        kinds = await asyncio.gather(*(self.service_type(name) for name in services))
        return {name: nodes for (name, nodes), found in zip(services.items(), kinds, strict=True) if found == kind}

    async def nodes(self) -> list[str]:
        """Names of nodes."""
        state = await self._blocking.run(self._master.state)
        return sorted({node for part in state for _, nodes in part for node in nodes})

    async def held_by(self, node: str, access: Access) -> tuple[list[str], list[str], list[str]]:
        """Topics that a node publishes, those it subscribes, and its services."""
        published, subscribed, services = (
            [name for name, nodes in part.items() if node in nodes] for part in await self._state(access)
        )
        return published, subscribed, services

    async def action_servers(self, access: Access) -> list[str]:
        """Names under which there are all topics of an action server."""
        publishers, subscribers, _ = await self._state(access)
        known = {*publishers, *subscribers}
        names = [topic.removesuffix("/goal") for topic in known if topic.endswith("/goal")]
        return sorted(name for name in names if all(f"{name}/{part}" in known for part in ACTION_TOPICS))

    async def service_type(self, service: str) -> str:
        """The type of a service, "" when its node does not answer, or there is none."""
        if (offered := self._offers.find(service)) is not None:
            return str(offered.cls._type)
        try:
            address = await self._blocking.run(self._master.service_address, service)
            kind, since = self._types.get((service, address), ("", 0.0))
            is_fresh = kind and time.monotonic() - since < self._config.connection_age
            return kind if is_fresh else await self._ask_type(service, address)
        except BridgeError:
            return ""

    async def _ask_type(self, service: str, address: tuple[str, int]) -> str:
        header = {"service": service, "md5sum": "*", "callerid": self._caller, "probe": "1"}
        link = Outgoing(header, self._config.response_limit)
        try:
            kind = (await link.connect(address, self._config.probe_timeout)).get("type", "")
        finally:
            link.close()
        if len(self._types) > 10_000:
            self._types.clear()
        self._types[service, address] = kind, time.monotonic()
        return kind

    async def _state(self, access: Access) -> tuple[dict[str, list[str]], dict[str, list[str]], dict[str, list[str]]]:
        publishers, subscribers, services = await self._blocking.run(self._master.state)
        return _seen(publishers, access.topics), _seen(subscribers, access.topics), _seen(services, access.services)


def _seen(entries: Entries, globs: Sequence[str]) -> dict[str, list[str]]:
    """Only what the client may use."""
    return {name: list(nodes) for name, nodes in entries if globs == ANY or matches(tuple(globs), name)}


def names(found: Any) -> list[str]:
    """In alphabetical order."""
    return sorted(found)
