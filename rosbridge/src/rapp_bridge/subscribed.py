"""A topic that clients subscribe: their wishes, and the connections to its publishers."""

import asyncio
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from rapp_bridge.arrival import Arrival, Wire
from rapp_bridge.client import Client
from rapp_bridge.decoding import Raw
from rapp_bridge.links import Outgoing
from rapp_bridge.node import Marker
from rapp_bridge.pace import Pace
from rapp_bridge.protocol import Subscribe


@dataclass(eq=False)
class Wish:
    """One client's subscription of one topic."""

    client: Client
    wire: Wire
    throttle: float  # s between messages
    queue_length: int
    due: float = float("-inf")
    held: deque[Arrival] = field(default_factory=deque)  # for when they are due
    timer: asyncio.TimerHandle | None = None

    def take(self, arrival: Arrival) -> None:
        """Offer a message to the client, now, when it is due, or not at all."""
        if self.throttle:
            now = asyncio.get_running_loop().time()
            if self.held or now < self.due:
                self._hold(arrival)
                return
            self.due = now + self.throttle
        self.client.offer(arrival, self.wire, self.queue_length)

    def _hold(self, arrival: Arrival) -> None:
        """Without a queue a message in the pause is dropped; with one the newest wait and come in their order."""
        if not self.queue_length:
            return
        if not self.held:
            self.timer = asyncio.get_running_loop().call_at(self.due, self._release)
        self.held.append(arrival)
        if len(self.held) > self.queue_length:
            self.held.popleft()

    def _release(self) -> None:
        loop = asyncio.get_running_loop()
        self.client.offer(self.held.popleft(), self.wire, self.queue_length)
        self.due = loop.time() + self.throttle
        if self.held:
            self.timer = loop.call_at(self.due, self._release)

    def end(self) -> None:
        """It is over, or another takes its place: what is held comes no more."""
        self.held.clear()
        if self.timer is not None:
            self.timer.cancel()


@dataclass(eq=False)
class Source:
    """A connection to one publisher; a latched topic's last message is kept for clients that come late."""

    link: Outgoing
    marker: Marker | None = None
    latest: Arrival | None = None
    cls: Any = None  # what its messages are; None: not known, or not the type that the clients want
    latched: bool = False

    @property
    def is_over(self) -> bool:
        """Whether the link ends, or rospy has asked for its end."""
        return not self.link.is_open or (self.marker is not None and self.marker.done)


@dataclass(eq=False)
class Subscribed:
    """A topic, who wants it, and who publishes it."""

    name: str
    cls: Any  # None: not known
    subscriber: Any = None
    wishes: dict[tuple[Client, str], Wish] = field(default_factory=dict)  # by client and the topic as the client wrote it
    sources: dict[str, Source] = field(default_factory=dict)
    errors: dict[str, str] = field(default_factory=dict)  # by publisher: why its messages cannot be had
    unused_since: float = 0.0

    def __post_init__(self) -> None:
        self._pace = Pace(self._hold)

    def _hold(self, on: bool) -> None:
        for source in self.sources.values():
            source.link.hold(on)

    def suits(self, wish: Subscribe) -> bool:
        """Whether the wish can join; a topic that nobody wants is rather opened anew when its type is another, or was wrong."""
        is_other = self.cls is not None and wish.type not in (None, self.cls._type)
        return bool(self.wishes) or not (is_other or self.errors)

    def deliver(self, source: Source, raw: Raw) -> None:
        """A publisher has sent a message."""
        if self.wishes or source.latched:
            arrival = Arrival(raw, source.cls)
            if source.latched:
                source.latest = arrival
            behind = False
            for wish in self.wishes.values():
                wish.take(arrival)
                behind = wish.client.is_behind
            if behind:
                self._pace.check({wish.client for wish in self.wishes.values()})

    def failed(self, publisher: str, text: str) -> None:
        """The messages of a publisher cannot be had: tell those who want them, and who comes later."""
        self.errors[publisher] = text
        for client in {wish.client for wish in self.wishes.values()}:
            client.tell("error", text)
