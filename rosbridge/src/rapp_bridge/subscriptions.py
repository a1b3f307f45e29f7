"""Topics that clients subscribe: one connection to each publisher for all clients of a topic, read on the event loop."""

import asyncio
import logging
import time
from collections.abc import Awaitable, Coroutine
from contextlib import suppress
from typing import Any

import rospy
from rospy.impl.registration import get_topic_manager

from rapp_bridge.arrival import Arrival, Wire
from rapp_bridge.blocking import Blocking
from rapp_bridge.client import Client
from rapp_bridge.config import Config
from rapp_bridge.errors import Invalid, Unreachable
from rapp_bridge.links import Outgoing
from rapp_bridge.master import Master, publishes
from rapp_bridge.node import Marker
from rapp_bridge.protocol import Subscribe, Unsubscribe
from rapp_bridge.rostypes import message_class
from rapp_bridge.subscribed import Source, Subscribed, Wish
from rapp_bridge.topics import registered, topic_type

CONNECT_TIMEOUT = 10.0  # s
RETRY = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # s between attempts at a publisher that cannot be reached

_log = logging.getLogger(__name__)


class Subscriptions:
    """All topics that clients subscribe, by their global names. Belongs to the event loop's thread."""

    def __init__(self, config: Config, master: Master, blocking: Blocking) -> None:
        self._config = config
        self._master = master
        self._blocking = blocking
        self._loop = asyncio.get_running_loop()
        self._change = asyncio.Lock()
        self._subscribed: dict[str, Subscribed] = {}
        self._connecting: set[asyncio.Task[None]] = set()

    def subscribe(self, client: Client, wish: Subscribe) -> Awaitable[None] | None:
        """Subscribe to the topic, or join it at once, and get what is latched; or change the client's wish.

        Raises BridgeError.
        """
        name = rospy.resolve_name(wish.topic)
        entry = self._subscribed.get(name)
        is_known = entry is not None and entry.subscriber is not None and (entry.cls is not None or wish.compression == "cbor-raw")
        if entry is None or not is_known or not entry.suits(wish):
            return self._subscribe(client, name, wish)
        self._join(entry, client, wish)
        return None

    def unsubscribe(self, client: Client, wish: Unsubscribe) -> None:
        """Take the client off the topic, if there; without clients the subscriber lives on for a while, see `sweep`."""
        entry = self._subscribed.get(rospy.resolve_name(wish.topic))
        if entry is not None and (over := entry.wishes.pop((client, wish.topic), None)) is not None:
            over.end()
            entry.unused_since = time.monotonic()

    async def sweep(self) -> None:
        """Close the subscribers that no client has used for a while; to be called now and then."""
        old = time.monotonic() - self._config.linger
        async with self._change:
            for name, entry in list(self._subscribed.items()):
                if not entry.wishes and entry.unused_since < old:
                    await self._close(name)

    def connect(self, name: str, publisher: str, address: tuple[str, int]) -> bool:
        """Connect to a publisher, soon; says whether the topic is ours. Called in rospy's threads."""
        if self._loop.is_closed() or name not in self._subscribed:
            return False
        self._loop.call_soon_threadsafe(self._connect, name, publisher, address)
        return True

    def _join(self, entry: Subscribed, client: Client, wish: Subscribe) -> None:
        if entry.cls is not None and wish.type not in (None, entry.cls._type):
            raise Invalid(f"cannot subscribe to {wish.topic} as {wish.type}: it is {entry.cls._type}; use that type")
        wire = Wire(wish.topic, wish.compression, wish.fragment_size)
        if (changed := entry.wishes.get((client, wish.topic))) is not None:
            changed.end()
        new = entry.wishes[client, wish.topic] = Wish(client, wire, wish.throttle_rate / 1000, wish.queue_length)
        if not wish.again:
            for text in entry.errors.values():
                client.tell("error", text)
            for source in entry.sources.values():
                if source.latest is not None:
                    new.take(source.latest)

    async def _subscribe(self, client: Client, name: str, wish: Subscribe) -> None:
        async with self._change:
            entry = self._subscribed.get(name)
            if entry is not None and not entry.suits(wish):
                await self._close(name)
                entry = None
            if entry is None:
                entry = await self._open(name, wish)
            elif entry.cls is None:
                await self._learn_type(entry, wish)
            self._join(entry, client, wish)

    async def _open(self, name: str, wish: Subscribe) -> Subscribed:
        cls = await self._find_class(name, wish)
        entry = self._subscribed[name] = Subscribed(name, cls, unused_since=time.monotonic())
        try:
            entry.subscriber = await self._blocking.run(registered, rospy.Subscriber, name, cls or rospy.AnyMsg)
        except Unreachable:
            del self._subscribed[name]
            raise
        return entry

    async def _close(self, name: str) -> None:
        entry = self._subscribed.pop(name)
        await self._blocking.run(entry.subscriber.unregister)

    async def _learn_type(self, entry: Subscribed, wish: Subscribe) -> None:
        if wish.compression != "cbor-raw":
            entry.cls = await self._find_class(entry.name, wish)
            for publisher, source in entry.sources.items():
                self._check_type(entry, publisher, source)
                if source.latest is not None:
                    source.latest = Arrival(source.latest.raw, source.cls)

    async def _find_class(self, name: str, wish: Subscribe) -> Any:
        kind = await self._blocking.run(topic_type, self._master, name, wish.type)
        if kind is not None and (wish.compression != "cbor-raw" or wish.type):
            return message_class(kind)
        if wish.compression == "cbor-raw":
            return None
        raise Invalid(f"cannot use topic {wish.topic} without a type: nobody publishes or subscribes it; give its type")

    def _connect(self, name: str, publisher: str, address: tuple[str, int]) -> None:
        entry = self._subscribed.get(name)
        if entry is None:
            return
        held = entry.sources.get(publisher)
        if held is not None and held.is_over:  # it has registered again, and the loop was too busy to see the old link end
            self._lost(entry, publisher, held)
        if publisher not in entry.sources:
            self._work(self._connect_to(entry, publisher, address))

    def _work(self, coroutine: Coroutine[Any, Any, None]) -> None:
        task = self._loop.create_task(coroutine)
        self._connecting.add(task)
        task.add_done_callback(self._connecting.discard)

    async def _connect_to(self, entry: Subscribed, publisher: str, address: tuple[str, int]) -> None:
        for pause in RETRY:
            if self._subscribed.get(entry.name) is not entry or publisher in entry.sources:
                return
            link = Outgoing(self._header(entry), self._config.message_limit)
            source = entry.sources[publisher] = Source(link)
            link.on_message = lambda raw, source=source: entry.deliver(source, raw)  # type: ignore[misc]
            link.on_lost = lambda source=source: self._lost(entry, publisher, source)  # type: ignore[misc]
            link.on_opened = lambda source=source: self._check_type(entry, publisher, source)  # type: ignore[misc]
            try:
                await link.connect(address, CONNECT_TIMEOUT)
            except Unreachable as error:
                entry.sources.pop(publisher, None)
                _log.warning("topic %s of %s: %s", entry.name, publisher, error)
                if link.fields:  # it has answered, so asking again helps nobody
                    entry.failed(publisher, f"cannot get the messages of {entry.name} from {publisher}: {error}")
                    return
                await asyncio.sleep(pause)
                continue
            if self._subscribed.get(entry.name) is entry:
                self._mark(entry, publisher, source)
            else:  # the topic was closed, and may have been opened anew, meanwhile
                link.close()
            return

    def _header(self, entry: Subscribed) -> dict[str, str]:
        cls = entry.cls or rospy.AnyMsg
        return {
            "topic": entry.name, "type": cls._type, "md5sum": cls._md5sum, "message_definition": cls._full_text,
            "callerid": rospy.get_name(), "tcp_nodelay": "1",
        }  # fmt: skip

    @staticmethod
    def _mark(entry: Subscribed, publisher: str, source: Source) -> None:
        source.marker = Marker("i", entry.name, publisher, source.link.close)
        rospys = get_topic_manager().get_subscriber_impl(entry.name)
        if rospys is None or not rospys.add_connection(source.marker):
            source.link.close()

    @staticmethod
    def _check_type(entry: Subscribed, publisher: str, source: Source) -> None:
        entry.errors.pop(publisher, None)
        fields = source.link.fields
        source.latched = fields.get("latching") == "1"
        if entry.cls is None or fields.get("md5sum") == entry.cls._md5sum:
            source.cls = entry.cls
        elif fields:
            node, kind, known = fields.get("callerid"), fields.get("type"), entry.cls._type
            entry.failed(publisher, f"cannot read {entry.name} of {node}: it is {kind}, not the {known} known here")

    def _lost(self, entry: Subscribed, publisher: str, source: Source) -> None:
        if entry.sources.get(publisher) is source:
            del entry.sources[publisher]
        if source.marker is not None and not source.marker.done:
            source.marker.close()
            self._work(self._ask_again(entry, publisher))

    async def _ask_again(self, entry: Subscribed, publisher: str) -> None:
        """The publisher has closed the link. It may publish on: rospy tells of it again only when it was gone from its lists."""
        await asyncio.sleep(RETRY[0])
        if self._subscribed.get(entry.name) is entry:
            with suppress(Unreachable):
                address = await self._blocking.run(publishes, publisher, entry.name, self._config.probe_timeout)
                if address is not None:
                    self._connect(entry.name, publisher, address)
