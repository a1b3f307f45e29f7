"""Topics that clients publish: one publisher for all clients of a topic, its subscribers served on the event loop."""

import asyncio
import time
from collections.abc import Awaitable
from dataclasses import dataclass, field
from typing import Any

import rospy
from rospy.impl.registration import get_topic_manager

from rapp_bridge.blocking import Blocking
from rapp_bridge.client import Client
from rapp_bridge.config import Config
from rapp_bridge.decoding import decode
from rapp_bridge.encoding import encode
from rapp_bridge.errors import Invalid, Unreachable
from rapp_bridge.forms import JSON
from rapp_bridge.links import SubscriberLink, Welcome
from rapp_bridge.master import Master
from rapp_bridge.newest import Newest
from rapp_bridge.node import Marker
from rapp_bridge.protocol import Advertise, Publish, Unadvertise
from rapp_bridge.rostypes import has_header, message_class
from rapp_bridge.topics import registered, topic_type

OPENING = 1.0  # s after the first advertisement in which messages are kept for subscribers that are still to connect
AWAITED = 10.0  # s in which they are kept for subscribers that were there before
WARNED_AGAIN = 1.0  # s between warnings about messages that are lost


@dataclass(eq=False)
class _Published:
    """A topic's publisher; new subscribers get what was kept: the last message of a latched topic, or what was published
    just before they had connected, for a client may publish right after advertise, and a page that is reloaded does.
    """

    name: str
    cls: Any
    latch: bool
    queue_size: int
    queue_limit: int  # bytes that wait for a subscriber, at most
    awaited: set[str]  # nodes that subscribe the topic, and have not connected yet
    publisher: Any = None
    clients: set[tuple[Client, str]] = field(default_factory=set)  # and the topic as they wrote it
    links: dict[SubscriberLink, Marker] = field(default_factory=dict)
    opened: float = field(default_factory=time.monotonic)
    unused_since: float = field(default_factory=time.monotonic)
    sequence: int = 0
    warned: float = float("-inf")

    def __post_init__(self) -> None:
        self.kept = Newest(1 if self.latch else self.queue_size, self.queue_limit)
        self.has_header = has_header(self.cls)
        self.keeps = True

    def suits(self, wish: Advertise) -> bool:
        return wish.type in ("", self.cls._type) and wish.latch == self.latch

    def send(self, raw: bytearray) -> None:
        self.sequence += 1
        if self.has_header:
            raw[:4] = (self.sequence & 0xFFFFFFFF).to_bytes(4, "little")
        framed = len(raw).to_bytes(4, "little") + raw
        if self.keeps:
            self.keep(framed)
        for link in self.links:
            link.send(framed)

    def keep(self, framed: bytes) -> None:
        if not self.latch and not self.is_opening:
            self.keeps = False
            self.kept.clear()
            return
        if any(self.kept.add(framed)) and self.awaited and not self.latch:
            self.warn(f"until {', '.join(sorted(self.awaited))} has connected; the oldest are dropped")

    @property
    def is_opening(self) -> bool:
        return time.monotonic() < self.opened + (AWAITED if self.awaited else OPENING)

    def warn(self, text: str) -> None:
        """Tell those who publish here that messages are lost, now and then."""
        now = time.monotonic()
        if now - self.warned > WARNED_AGAIN:
            self.warned = now
            for client in {client for client, _ in self.clients}:
                client.tell("warning", f"cannot keep the messages of {self.name} {text}")

    def welcome(self, link: SubscriberLink, caller: str) -> None:
        """Send a new subscriber what was kept for it."""
        if self.latch or self.is_opening:
            for framed in self.kept:
                link.send(framed)
        self.awaited.discard(caller)


class Publications:
    """All topics that clients publish, by their global names. Belongs to the event loop's thread."""

    def __init__(self, config: Config, master: Master, blocking: Blocking) -> None:
        self._linger = config.linger
        self._queue_limit = config.queue_limit
        self._master = master
        self._blocking = blocking
        self._change = asyncio.Lock()
        self._published: dict[str, _Published] = {}

    def advertise(self, client: Client, wish: Advertise) -> Awaitable[None] | None:
        """Register the topic's publisher, or join it at once; without a type the master's is taken. Raises BridgeError."""
        name = rospy.resolve_name(wish.topic)
        entry = self._published.get(name)
        if entry is None or (not entry.clients and not entry.suits(wish)):
            return self._advertise(client, name, wish)
        if wish.type not in ("", entry.cls._type):
            raise Invalid(f"cannot advertise {wish.topic} as {wish.type}: it is {entry.cls._type}; use that type")
        entry.clients.add((client, wish.topic))
        return None

    async def _advertise(self, client: Client, name: str, wish: Advertise) -> None:
        async with self._change:
            entry = self._published.get(name)
            if entry is not None and not entry.clients and not entry.suits(wish):
                await self._close(name)
                entry = None
            if entry is None:
                await self._open(name, wish)
        self.advertise(client, wish)

    async def _open(self, name: str, wish: Advertise) -> None:
        kind = await self._blocking.run(topic_type, self._master, name, wish.type)
        if kind is None:
            raise Invalid(f"cannot use topic {wish.topic} without a type: nobody publishes or subscribes it; give its type")
        cls, size = message_class(kind), max(1, wish.queue_size)
        awaited = await self._blocking.run(self._master.subscribers, name)
        entry = self._published[name] = _Published(name, cls, wish.latch, size, self._queue_limit, awaited)
        try:
            entry.publisher = await self._blocking.run(_publisher, name, cls, wish.latch)
        except Unreachable:
            del self._published[name]
            raise

    def unadvertise(self, client: Client, wish: Unadvertise) -> None:
        """Leave the topic's publisher, if there; without clients it lives on for a while, see `sweep`."""
        entry = self._published.get(rospy.resolve_name(wish.topic))
        if entry is not None and (client, wish.topic) in entry.clients:
            entry.clients.discard((client, wish.topic))
            entry.unused_since = time.monotonic()

    async def sweep(self) -> None:
        """Unregister the publishers that no client has used for a while; to be called now and then."""
        old = time.monotonic() - self._linger
        async with self._change:
            for name, entry in list(self._published.items()):
                if not entry.clients and entry.unused_since < old:
                    await self._close(name)

    def publish(self, client: Client, wish: Publish) -> Awaitable[None] | None:
        """Publish one message; a client that has not advertised the topic does so by this. Raises BridgeError."""
        name = rospy.resolve_name(wish.topic)
        entry = self._published.get(name)
        if entry is None or (client, wish.topic) not in entry.clients:
            return self._advertise_and_publish(client, wish)
        entry.send(_serialized(wish, entry.cls))
        return None

    async def _advertise_and_publish(self, client: Client, wish: Publish) -> None:
        name = rospy.resolve_name(wish.topic)
        entry = self._published.get(name)
        latch = entry.latch if entry is not None and entry.clients else wish.latch
        waiting = self.advertise(client, Advertise(wish.topic, "", None, latch, wish.queue_size))
        if waiting is not None:
            await waiting
        self.publish(client, wish)

    def publish_own(self, name: str, values: dict[str, Any]) -> None:
        """Publish a message of the bridge's own, on a topic that it has advertised."""
        entry = self._published[name]
        entry.send(encode(values, entry.cls))

    def accept(self, header: dict[str, str], transport: Any) -> Welcome:
        """A ROS subscriber has connected; see `node.Acceptor`."""
        name = header.get("topic", "")
        entry = self._published.get(name)
        if entry is None:
            raise Unreachable(f"cannot serve {name}: it is not published here")
        cls = entry.cls
        if header.get("md5sum", "*") not in ("*", cls._md5sum):
            raise Invalid(f"cannot serve {name} as {header.get('type', 'that type')}: it is {cls._type}, md5sum {cls._md5sum}")
        if header.get("type", "*") not in ("*", cls._type):
            raise Invalid(f"cannot serve {name} as {header['type']}: it is {cls._type}")
        caller = header.get("callerid", "")
        link = SubscriberLink(
            transport,
            entry.queue_size,
            entry.queue_limit,
            lambda gone: self._lost(entry, gone),
            lambda: entry.warn(f"for {caller}: it reads too slowly; the oldest are dropped"),
        )
        ours = {
            "topic": name, "type": cls._type, "md5sum": cls._md5sum, "message_definition": cls._full_text,
            "latching": str(int(entry.latch)), "callerid": rospy.get_name(),
        }  # fmt: skip
        return Welcome(ours, link, lambda: self._begin(entry, link, caller))

    def _begin(self, entry: _Published, link: SubscriberLink, caller: str) -> None:
        marker = entry.links[link] = Marker("o", entry.name, caller, link.close)
        rospys = get_topic_manager().get_publisher_impl(entry.name)
        if rospys is not None:
            rospys.add_connection(marker)
        entry.welcome(link, caller)

    @staticmethod
    def _lost(entry: _Published, link: SubscriberLink) -> None:
        marker = entry.links.pop(link, None)
        if marker is not None:
            marker.close()

    async def _close(self, name: str) -> None:
        entry = self._published.pop(name)
        if entry.publisher is not None:
            await self._blocking.run(entry.publisher.unregister)
        for link in list(entry.links):
            link.close()


def _publisher(name: str, cls: Any, latch: bool) -> Any:
    return registered(rospy.Publisher, name, cls, latch=latch, queue_size=1)


def _serialized(wish: Publish, cls: Any) -> bytearray:
    if not wish.raw:
        return encode(wish.msg, cls)
    raw = wish.msg.get("bytes")
    if type(raw) is not bytes:
        raise Invalid(f"cannot publish on {wish.topic}: a cbor-raw message has its serialized bytes in field bytes")
    decode(raw, cls, JSON)  # whoever receives it may trust its lengths
    return bytearray(raw)
