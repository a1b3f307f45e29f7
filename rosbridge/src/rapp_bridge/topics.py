"""Topics between rospy and clients: publishers and subscribers are shared by all clients of a topic."""

import threading
import time
from dataclasses import dataclass, field
from typing import Any

import rospy
import rostopic

from rapp_bridge.client import Client
from rapp_bridge.conversion import from_json, message_class, writer
from rapp_bridge.errors import Invalid
from rapp_bridge.protocol import Advertise, Publish, Subscribe, Unadvertise, Unsubscribe, publication

DEFAULT_QUEUE = 100  # messages of one topic that may wait for one client


@dataclass
class _Published:
    publisher: Any
    type: str
    clients: set[Client] = field(default_factory=set)


@dataclass
class _Wish:
    """One client's subscription of one topic."""

    throttle: float  # s between messages
    queue_length: int
    ids: set[str | int | None]
    last: float = float("-inf")


@dataclass
class _Subscribed:
    subscriber: Any
    type: str
    wishes: dict[Client, _Wish] = field(default_factory=dict)


class Topics:
    """All topics the clients publish and subscribe."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._published: dict[str, _Published] = {}
        self._subscribed: dict[str, _Subscribed] = {}

    def advertise(self, client: Client, wish: Advertise) -> None:
        """Register the topic's publisher, or join it; raises Invalid when its type is another one."""
        with self._lock:
            entry = self._published.get(wish.topic)
            if entry is None:
                cls = message_class(wish.type)
                publisher = rospy.Publisher(wish.topic, cls, latch=wish.latch, queue_size=max(1, wish.queue_size))
                entry = self._published[wish.topic] = _Published(publisher, wish.type)
            elif entry.type != wish.type:
                raise Invalid(f"cannot advertise {wish.topic} as {wish.type}: it is {entry.type}")
            entry.clients.add(client)

    def unadvertise(self, client: Client, wish: Unadvertise) -> None:
        """Leave the topic's publisher, which is unregistered when nobody is left."""
        with self._lock:
            entry = self._published.get(wish.topic)
            if entry is None or client not in entry.clients:
                raise Invalid(f"cannot unadvertise {wish.topic}: this client does not advertise it")
            self._leave_publisher(client, wish.topic)

    def publish(self, client: Client, wish: Publish) -> None:
        """Publish one message, advertising the topic first when its type is known to the master."""
        with self._lock:
            entry = self._published.get(wish.topic)
            if entry is None or client not in entry.clients:
                self.advertise(client, Advertise(wish.topic, _known_type(wish.topic)))
                entry = self._published[wish.topic]
        message = from_json(wish.msg, entry.type, entry.publisher.data_class)
        try:
            entry.publisher.publish(message)
        except rospy.ROSException as error:
            raise Invalid(f"cannot publish on {wish.topic}: {error}") from error

    def subscribe(self, client: Client, wish: Subscribe) -> None:
        """Subscribe to the topic, or join it; latched messages are replayed to a joining client."""
        with self._lock:
            entry = self._subscribed.get(wish.topic)
            late = entry is not None and client not in entry.wishes
            if entry is None:
                entry = self._open(wish)
            elif wish.type not in (None, entry.type):
                raise Invalid(f"cannot subscribe to {wish.topic} as {wish.type}: it is {entry.type}")
            old = entry.wishes.get(client)
            ids = {wish.id} | (old.ids if old else set())
            throttle = wish.throttle_rate / 1000
            if old is not None:
                throttle = min(throttle, old.throttle)
            entry.wishes[client] = _Wish(throttle, wish.queue_length or DEFAULT_QUEUE, ids)
        if late:
            entry.subscriber.impl.add_callback(self._deliver_to, (wish.topic, client))
            entry.subscriber.impl.remove_callback(self._deliver_to, (wish.topic, client))

    def _open(self, wish: Subscribe) -> _Subscribed:
        type_name = wish.type or _known_type(wish.topic)
        cls = message_class(type_name)
        entry = _Subscribed(None, type_name)
        self._subscribed[wish.topic] = entry
        encode = writer(cls)

        def deliver(message: Any) -> None:
            self._deliver(wish.topic, publication(wish.topic, encode(message)))

        entry.subscriber = rospy.Subscriber(wish.topic, cls, deliver, tcp_nodelay=True)
        return entry

    def unsubscribe(self, client: Client, wish: Unsubscribe) -> None:
        """Give up one subscription (with an id) or all of them (without); the last one closes the subscriber."""
        with self._lock:
            entry = self._subscribed.get(wish.topic)
            if entry is None or client not in entry.wishes:
                raise Invalid(f"cannot unsubscribe from {wish.topic}: this client is not subscribed")
            ids = entry.wishes[client].ids
            if wish.id is not None:
                ids.discard(wish.id)
            if wish.id is None or not ids:
                self._leave_subscriber(client, wish.topic)

    def forget(self, client: Client) -> None:
        """Undo all that a client has advertised and subscribed."""
        with self._lock:
            for topic in [t for t, e in self._published.items() if client in e.clients]:
                self._leave_publisher(client, topic)
            for topic in [t for t, e in self._subscribed.items() if client in e.wishes]:
                self._leave_subscriber(client, topic)

    def _leave_publisher(self, client: Client, topic: str) -> None:
        entry = self._published[topic]
        entry.clients.discard(client)
        if not entry.clients:
            del self._published[topic]
            entry.publisher.unregister()

    def _leave_subscriber(self, client: Client, topic: str) -> None:
        entry = self._subscribed[topic]
        del entry.wishes[client]
        if not entry.wishes:
            del self._subscribed[topic]
            entry.subscriber.unregister()

    def _deliver_to(self, message: Any, target: tuple[str, Client]) -> None:
        """Replay of a latched message, which rospy gives to a callback that is added late."""
        topic, client = target
        with self._lock:
            entry = self._subscribed.get(topic)
            wish = entry.wishes.get(client) if entry else None
        if wish is not None:
            client.offer(topic, publication(topic, writer(message.__class__)(message)), wish.queue_length)

    def _deliver(self, topic: str, text: str) -> None:
        now = time.monotonic()
        with self._lock:
            entry = self._subscribed.get(topic)
            wishes = list(entry.wishes.items()) if entry else []
            due = [(client, wish) for client, wish in wishes if now - wish.last >= wish.throttle]
            for _, wish in due:
                wish.last = now
        for client, wish in due:
            client.offer(topic, text, wish.queue_length)


def _known_type(topic: str) -> str:
    name = rospy.resolve_name(topic)
    type_name, _, _ = rostopic.get_topic_type(name)
    if type_name is None:
        raise Invalid(f"cannot use topic {topic} without a type: nobody publishes or subscribes it; give its type")
    return str(type_name)
