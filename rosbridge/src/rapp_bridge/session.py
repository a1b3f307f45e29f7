"""One client's session, pure: frames in, effects out. What a client holds is known here, so that all of it can be undone."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from rapp_bridge.errors import BridgeError, Invalid, Refused
from rapp_bridge.protocol import (
    Advertise,
    AdvertiseService,
    CallService,
    Id,
    Message,
    Publish,
    ServiceResponse,
    Subscribe,
    Unadvertise,
    UnadvertiseService,
    Unsubscribe,
    decode,
    error_status,
    parse,
    service_result,
)


@dataclass(frozen=True)
class Send:
    """Send this frame to the client."""

    frame: bytes


Effect = Send | Message
"""A message among the effects is to be carried out on the ROS side; when that fails, `Session.failed` says what follows."""


def _nothing() -> None:
    """What undoes a frame that changed nothing here."""


class Session:
    """The protocol state of one client. A bad frame has one effect, the error's text, and changes nothing.

    Several ids of one topic are one subscription (advertisement) on the ROS side, with the most demanding settings; it ends
    with the last id, or at once when the client names none.
    """

    def __init__(self, names: int, calls: int) -> None:
        self._names = names  # ids of topics and services held at once, at most
        self._most_calls = calls
        self._calls = 0
        self._advertised: dict[str, set[Id]] = {}
        self._subscribed: dict[str, dict[Id, Subscribe]] = {}
        self._offered: set[str] = set()
        self._undo: Callable[[], object] = _nothing  # of what the last frame changed here
        self._handlers: dict[type, Callable[[Any], list[Effect]]] = {
            Advertise: self._advertise,
            Unadvertise: self._unadvertise,
            Publish: self._publish,
            Subscribe: self._subscribe,
            Unsubscribe: self._unsubscribe,
            CallService: self._call,
            AdvertiseService: self._offer,
            UnadvertiseService: self._withdraw,
            ServiceResponse: lambda message: [message],
        }

    def receive(self, frame: str | bytes) -> list[Effect]:
        """Read one frame; gives what is to be done, in order."""
        message_id: Id = None
        self._undo = _nothing
        try:
            fields = parse(frame)
            given = fields.get("id")
            message_id = given if isinstance(given, str | int) else None
            message = decode(fields)
        except BridgeError as error:
            return [Send(error_status(str(error), message_id))]
        try:
            return self._handlers[type(message)](message)
        except BridgeError as error:
            return [self._error(message, error)]

    def answered(self, call: CallService, values: Any) -> list[Effect]:
        """A call has been answered with the response's fields."""
        self._calls -= 1
        return [Send(service_result(call, values, True))]

    def failed(self, effect: Message, error: BridgeError) -> list[Effect]:
        """An effect could not be carried out: what it had changed here is undone, and the client is told.

        Effects but calls are carried out before the next frame is received.
        """
        if isinstance(effect, CallService):
            self._calls -= 1
        else:
            self._undo()
        return [self._error(effect, error)]

    def close(self) -> list[Effect]:
        """The client has left: what undoes all it held; services first, for somebody may wait for them."""
        effects: list[Effect] = [UnadvertiseService(name) for name in sorted(self._offered)]
        effects += [Unsubscribe(topic) for topic in self._subscribed]
        effects += [Unadvertise(topic) for topic in self._advertised]
        self._offered.clear()
        self._subscribed.clear()
        self._advertised.clear()
        return effects

    @staticmethod
    def _error(message: Message, error: BridgeError) -> Send:
        if isinstance(message, CallService):
            return Send(service_result(message, str(error), False))
        return Send(error_status(str(error), getattr(message, "id", None)))

    def _make_room(self, name: str) -> None:
        held = len(self._offered) + sum(map(len, self._advertised.values())) + sum(map(len, self._subscribed.values()))
        if held >= self._names:
            raise Refused(f"cannot hold {name}: this client holds {held} topics and services; give some up first")

    def _advertise(self, wish: Advertise) -> list[Effect]:
        if wish.id not in self._advertised.get(wish.topic, ()):
            self._make_room(wish.topic)
            self._advertised.setdefault(wish.topic, set()).add(wish.id)
            self._undo = partial(self._discard, self._advertised, wish.topic, wish.id)
        return [wish]

    def _publish(self, wish: Publish) -> list[Effect]:
        if wish.topic not in self._advertised:
            self._advertise(Advertise(wish.topic, ""))
        return [wish]

    def _unadvertise(self, wish: Unadvertise) -> list[Effect]:
        ids = self._advertised.get(wish.topic)
        if ids is None or (wish.id is not None and wish.id not in ids):
            raise Invalid(f"cannot unadvertise {wish.topic}: this client does not advertise it so; advertise first")
        if wish.id is None:
            del self._advertised[wish.topic]
        else:
            self._discard(self._advertised, wish.topic, wish.id)
        return [] if wish.topic in self._advertised else [wish]

    def _subscribe(self, wish: Subscribe) -> list[Effect]:
        before = self._subscribed.get(wish.topic, {}).get(wish.id)
        if before is None:
            self._make_room(wish.topic)
            self._undo = partial(self._drop_subscription, wish.topic, wish.id)
        else:
            self._undo = partial(self._subscribed[wish.topic].__setitem__, wish.id, before)
        self._subscribed.setdefault(wish.topic, {})[wish.id] = wish
        return [self._merged(wish)]

    def _unsubscribe(self, wish: Unsubscribe) -> list[Effect]:
        wishes = self._subscribed.get(wish.topic)
        if wishes is None or (wish.id is not None and wish.id not in wishes):
            raise Invalid(f"cannot unsubscribe from {wish.topic}: this client is not subscribed so; subscribe first")
        if wish.id is None:
            del self._subscribed[wish.topic]
        else:
            self._drop_subscription(wish.topic, wish.id)
        left = self._subscribed.get(wish.topic)
        return [self._merged(next(iter(left.values())))] if left else [wish]

    def _merged(self, wish: Subscribe) -> Subscribe:
        wishes = self._subscribed[wish.topic].values()
        throttle = min(each.throttle_rate for each in wishes)
        lengths = {each.queue_length for each in wishes}
        return replace(wish, throttle_rate=throttle, queue_length=0 if 0 in lengths else max(lengths))

    def _call(self, wish: CallService) -> list[Effect]:
        if self._calls >= self._most_calls:
            raise Refused(f"cannot call {wish.service}: {self._calls} calls are open; wait for some answers first")
        self._calls += 1
        return [wish]

    def _offer(self, wish: AdvertiseService) -> list[Effect]:
        if wish.service not in self._offered:
            self._make_room(wish.service)
            self._undo = partial(self._offered.discard, wish.service)
        self._offered.add(wish.service)
        return [wish]

    def _withdraw(self, wish: UnadvertiseService) -> list[Effect]:
        if wish.service not in self._offered:
            raise Invalid(f"cannot unadvertise {wish.service}: this client does not offer it; advertise it first")
        self._offered.discard(wish.service)
        return [wish]

    def _drop_subscription(self, topic: str, message_id: Id) -> None:
        wishes = self._subscribed.get(topic, {})
        wishes.pop(message_id, None)
        if not wishes:
            self._subscribed.pop(topic, None)

    @staticmethod
    def _discard(held: dict[str, set[Id]], topic: str, message_id: Id) -> None:
        ids = held.get(topic, set())
        ids.discard(message_id)
        if not ids:
            held.pop(topic, None)
