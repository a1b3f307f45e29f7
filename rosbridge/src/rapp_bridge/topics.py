"""Topics between rospy and clients: publishers and subscribers are shared by all clients of a topic."""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import rospy

from rapp_bridge.client import Client
from rapp_bridge.config import Config
from rapp_bridge.conversion import from_json, message_class, writer
from rapp_bridge.errors import Invalid, Unreachable
from rapp_bridge.master import Master
from rapp_bridge.protocol import Advertise, Publish, Subscribe, Unadvertise, Unsubscribe, publication

DEFAULT_QUEUE = 10_000  # messages of one topic that may wait for one client that names no queue_length; bytes bound it too
OPENING_KEPT = 32  # messages, at most, that are kept meanwhile
OPENING = 1.0  # s after the first advertisement in which messages are kept for subscribers that are still connecting


class _Opening(rospy.SubscribeListener):  # type: ignore[misc]
    """Gives a new subscriber what was published just before it had connected: a client may publish right after advertise."""

    def __init__(self, kept: int) -> None:
        self._until = time.monotonic() + OPENING
        self._recent: deque[Any] = deque(maxlen=kept)
        self._lock = threading.Lock()

    def publish(self, publisher: Any, message: Any) -> None:
        """Publish, and keep the message while the topic opens."""
        if self.ended():
            publisher.publish(message)
            return
        with self._lock:
            self._recent.append(message)
            publisher.publish(message)

    def ended(self) -> bool:
        """Whether the topic has been opened; what was kept is then forgotten."""
        if time.monotonic() <= self._until:
            return False
        if self._recent:
            with self._lock:
                self._recent.clear()
        return True

    def peer_subscribe(self, topic_name: str, topic_publish: Any, peer_publish: Callable[[Any], None]) -> None:
        """Called by rospy for each new subscriber."""
        if not self.ended():
            with self._lock:
                for message in self._recent:
                    peer_publish(message)


@dataclass
class _Published:
    publisher: Any
    type: str
    opening: _Opening | None
    clients: set[Client] = field(default_factory=set)
    unused_since: float = 0.0

    def suits(self, wish: Advertise) -> bool:
        return wish.type in ("", self.type) and wish.latch == (self.opening is None)


@dataclass
class _Wish:
    """One client's subscription of one topic."""

    throttle: float  # s between messages
    queue_length: int
    last: float = float("-inf")

    def is_due(self, now: float) -> bool:
        if now - self.last < self.throttle:
            return False
        self.last = now
        return True


class _Subscribed:
    """A rospy subscriber and the clients behind it; `wishes` is replaced as a whole, so deliveries need no lock."""

    def __init__(self, topic: str, type_name: str, cls: Any) -> None:
        self.type = type_name
        self.wishes: dict[Client, _Wish] = {}
        self._topic = topic
        self._encode = writer(cls)
        self.subscriber: Any = None

    def deliver(self, message: Any) -> None:
        """One ROS message to all clients that want it now; encoded once for all."""
        now = time.monotonic()
        due = [(client, wish) for client, wish in self.wishes.items() if wish.is_due(now)]
        if due:
            frame = publication(self._topic, self._encode(message))
            for client, wish in due:
                client.offer(self._topic, frame, wish.queue_length)

    def replay(self, message: Any, client: Client) -> None:
        """A latched message to one client that came late."""
        wish = self.wishes.get(client)
        if wish is not None:
            client.offer(self._topic, publication(self._topic, self._encode(message)), wish.queue_length)


class Topics:
    """All topics the clients publish and subscribe, by the name as the client wrote it.

    `publish` and `advertised` do not block; all other methods ask the master and do. Any thread may call them.
    """

    def __init__(self, config: Config, master: Master) -> None:
        self._linger = config.linger
        self._master = master
        self._change = threading.Lock()
        self._published: dict[str, _Published] = {}
        self._subscribed: dict[str, _Subscribed] = {}

    def advertised(self, client: Client, topic: str) -> bool:
        """Whether the client is among the topic's publishers."""
        entry = self._published.get(topic)
        return entry is not None and client in entry.clients

    def advertise(self, client: Client, wish: Advertise) -> None:
        """Register the topic's publisher, or join it; without a type the master's is taken. Raises BridgeError."""
        with self._change:
            entry = self._published.get(wish.topic)
            if entry is not None and not entry.clients and not entry.suits(wish):
                self._close_publisher(wish.topic)
                entry = None
            if entry is None:
                entry = self._published[wish.topic] = self._open_publisher(wish)
            elif wish.type not in ("", entry.type):
                raise Invalid(f"cannot advertise {wish.topic} as {wish.type}: it is {entry.type}; use that type")
            entry.clients.add(client)

    def _open_publisher(self, wish: Advertise) -> _Published:
        type_name = self._type(wish.topic, wish.type)
        cls = message_class(type_name)
        size = max(1, wish.queue_size)
        opening = None if wish.latch else _Opening(min(size, OPENING_KEPT))
        try:
            publisher = rospy.Publisher(wish.topic, cls, opening, latch=wish.latch, queue_size=size)
        except (rospy.ROSException, OSError, ValueError) as error:
            raise Unreachable(f"cannot advertise {wish.topic}: {error}") from error
        return _Published(publisher, type_name, opening)

    def unadvertise(self, client: Client, wish: Unadvertise) -> None:
        """Leave the topic's publisher, if there; without clients it lives on for a while, see `sweep`."""
        with self._change:
            entry = self._published.get(wish.topic)
            if entry is not None and client in entry.clients:
                entry.clients.discard(client)
                entry.unused_since = time.monotonic()

    def sweep(self) -> None:
        """Unregister the publishers that no client has used for a while; to be called now and then."""
        with self._change:
            for entry in self._published.values():
                if entry.opening is not None:
                    entry.opening.ended()
            old = time.monotonic() - self._linger
            for topic in [t for t, e in self._published.items() if not e.clients and e.unused_since < old]:
                self._close_publisher(topic)

    def publish(self, wish: Publish) -> None:
        """Publish one message on an advertised topic; raises Invalid when it does not fit."""
        entry = self._published.get(wish.topic)
        if entry is None:
            raise Invalid(f"cannot publish on {wish.topic}: it is not advertised; advertise it first")
        message = from_json(wish.msg, entry.publisher.data_class)
        try:
            if entry.opening is None:
                entry.publisher.publish(message)
            else:
                entry.opening.publish(entry.publisher, message)
        except rospy.ROSException as error:
            raise Invalid(f"cannot publish on {wish.topic}: {error}") from error

    def subscribe(self, client: Client, wish: Subscribe) -> None:
        """Subscribe to the topic, join it (and get what is latched), or change the client's wish. Raises BridgeError."""
        with self._change:
            entry = self._subscribed.get(wish.topic)
            if entry is not None and wish.type not in (None, entry.type):
                raise Invalid(f"cannot subscribe to {wish.topic} as {wish.type}: it is {entry.type}; use that type")
            new = _Wish(wish.throttle_rate / 1000, wish.queue_length or DEFAULT_QUEUE)
            if entry is None:
                self._open_subscriber(client, wish, new)
                return
            late = client not in entry.wishes
            entry.wishes = {**entry.wishes, client: new}
            if late:  # rospy gives a callback that is added late the latched messages
                entry.subscriber.impl.add_callback(entry.replay, client)
                entry.subscriber.impl.remove_callback(entry.replay, client)

    def _open_subscriber(self, client: Client, wish: Subscribe, first: _Wish) -> None:
        type_name = self._type(wish.topic, wish.type)
        cls = message_class(type_name)
        entry = _Subscribed(wish.topic, type_name, cls)
        entry.wishes = {client: first}
        try:
            entry.subscriber = rospy.Subscriber(wish.topic, cls, entry.deliver, tcp_nodelay=True)
        except (rospy.ROSException, OSError, ValueError) as error:
            raise Unreachable(f"cannot subscribe to {wish.topic}: {error}") from error
        self._subscribed[wish.topic] = entry

    def unsubscribe(self, client: Client, wish: Unsubscribe) -> None:
        """Take the client off the topic, if there; without clients the subscriber is closed."""
        with self._change:
            entry = self._subscribed.get(wish.topic)
            if entry is None:
                return
            entry.wishes = {other: kept for other, kept in entry.wishes.items() if other is not client}
            if not entry.wishes:
                del self._subscribed[wish.topic]
                entry.subscriber.unregister()

    def _close_publisher(self, topic: str) -> None:
        self._published.pop(topic).publisher.unregister()

    def _type(self, topic: str, wanted: str | None) -> str:
        """The topic's type; a wanted one must be that which the master knows, if it knows one."""
        known = self._master.topic_type(rospy.resolve_name(topic))
        if known is None and not wanted:
            raise Invalid(f"cannot use topic {topic} without a type: nobody publishes or subscribes it; give its type")
        if known is not None and wanted and known != wanted:
            raise Invalid(f"cannot use topic {topic} as {wanted}: it is {known}; use that type")
        return str(wanted or known)
