"""One client's session, pure: frames in, effects out. What a client holds is known here, so that all of it can be undone."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from rapp_bridge.access import EVERYTHING, Access, Gate
from rapp_bridge.effects import Close, Effect, Limits, Send
from rapp_bridge.errors import BridgeError, Invalid, Refused
from rapp_bridge.forms import Piece
from rapp_bridge.fragments import Fragments
from rapp_bridge.incoming import decode, id_of, parse
from rapp_bridge.outgoing import cut, service_failure, service_result, status
from rapp_bridge.protocol import (
    COMPRESSIONS,
    LEVELS,
    Advertise,
    AdvertiseService,
    Auth,
    CallService,
    Fragment,
    Id,
    Level,
    Message,
    Publish,
    ServiceResponse,
    SetLevel,
    Subscribe,
    Unadvertise,
    UnadvertiseService,
    Unsubscribe,
)
from rapp_bridge.websocket import POLICY


def _nothing() -> None:
    """What undoes a frame that changed nothing here."""


class Session:
    """The protocol state of one client. A bad frame has one effect, the error's text, and changes nothing.

    Several ids of one topic are one subscription (advertisement) on the ROS side, with the most demanding settings; it ends
    with the last id, or at once when the client names none. Until a client has shown who it is, any frame that does not do
    so ends the session, and nothing is carried out after that.
    """

    def __init__(self, limits: Limits, gate: Gate, resolve: Callable[[str], str], access: Access | None = None) -> None:
        """`resolve` makes a name global; `access`: who the client is, when it has shown that already."""
        self._limits = limits
        self._gate = gate
        self._resolve = resolve
        self._access = EVERYTHING if gate.is_open else access
        self._over = False
        self._level: Level = "error"
        self._fragments = Fragments(limits.fragments, limits.fragment_seconds)
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
            SetLevel: self._set_level,
            Auth: lambda message: [],  # shown already, or not needed
        }

    @property
    def access(self) -> Access | None:
        """What the client may use; None until it has shown who it is."""
        return self._access

    def receive(self, frame: str | bytes, now: float) -> list[Effect]:
        """Read one frame, at this time in s; gives what is to be done, in order."""
        if self._over:
            return []
        self._undo = _nothing
        fields: dict[str, Any] = {}
        fragment_id: Id = None
        try:
            fields = parse(frame)
            message = decode(fields)
            if self._access is None:
                return self._enter(message)
            if type(message) is Fragment:
                text = self._fragments.take(message, now)
                if text is None:
                    return []
                fragment_id, whole = message.id, parse(text)
                if whole.get("op") == "fragment":
                    raise Invalid("cannot use a fragment made of fragments")
                fields = whole
                message = decode(fields)
        except BridgeError as error:
            return self._bad_frame(error, fields, fragment_id)
        return self._serve(message)

    def answered(self, call: CallService, values: list[Piece]) -> list[Effect]:
        """A call has been answered with the JSON of the response's fields."""
        self._calls -= 1
        return [Send(service_result(call, values))]

    def failed(self, effect: Message, error: BridgeError) -> list[Effect]:
        """An effect could not be carried out: what it had changed here is undone, and the client is told.

        Effects but calls are carried out before the next frame is received.
        """
        if type(effect) is CallService:
            self._calls -= 1
        else:
            self._undo()
        return self._error(effect, error)

    def tell(self, level: Level, text: str, message_id: Id = None) -> list[Effect]:
        """A status for the client, if it wants those of this level."""
        if LEVELS.index(level) < LEVELS.index(self._level):
            return []
        return [Send(status(level, text, message_id))]

    def close(self) -> list[Effect]:
        """The client has left: what undoes all it held; services first, for somebody may wait for them."""
        self._over = True
        effects: list[Effect] = [UnadvertiseService(name) for name in sorted(self._offered)]
        effects += [Unsubscribe(topic) for topic in self._subscribed]
        effects += [Unadvertise(topic) for topic in self._advertised]
        self._offered.clear()
        self._subscribed.clear()
        self._advertised.clear()
        return effects

    def _serve(self, message: Message) -> list[Effect]:
        try:
            return self._handlers[type(message)](message)
        except BridgeError as error:
            return self._error(message, error)

    def _bad_frame(self, error: BridgeError, fields: dict[str, Any], fragment_id: Id) -> list[Effect]:
        if self._access is None:
            return self._turn_away(error)
        message_id, service = id_of(fields), fields.get("service")
        if fields.get("op") == "call_service" and type(service) is str:  # its caller waits
            return [Send(service_failure(CallService(cut(service), {}, message_id), str(error)))]
        return self.tell("error", str(error), fragment_id if message_id is None else message_id)

    def _enter(self, message: Message) -> list[Effect]:
        if type(message) is not Auth:
            raise Refused("cannot serve you yet: the first message must be auth")
        self._access = self._gate.by_auth(message)
        return []

    def _turn_away(self, error: BridgeError) -> list[Effect]:
        self._over = True
        return [Send(status("error", str(error))), Close(POLICY, "not authenticated")]

    def _error(self, message: Message, error: BridgeError) -> list[Effect]:
        if type(message) is CallService:
            return [Send(service_failure(message, str(error)))]
        return self.tell("error", str(error), getattr(message, "id", None))

    def _set_level(self, wish: SetLevel) -> list[Effect]:
        self._level = wish.level
        return []

    def _may(self, kind: str, name: str) -> None:
        assert self._access is not None
        getattr(self._access, kind)(self._resolve(name))

    def _make_room(self, name: str) -> None:
        held = len(self._offered) + sum(map(len, self._advertised.values())) + sum(map(len, self._subscribed.values()))
        if held >= self._limits.names:
            raise Refused(f"cannot hold {name}: this client holds {held} topics and services; give some up first")

    def _advertise(self, wish: Advertise) -> list[Effect]:
        if wish.id not in self._advertised.get(wish.topic, ()):
            self._may("topic", wish.topic)
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
            self._may("topic", wish.topic)
            self._make_room(wish.topic)
            self._undo = partial(self._drop_subscription, wish.topic, wish.id)
        else:
            self._undo = partial(self._subscribed[wish.topic].__setitem__, wish.id, before)
        self._subscribed.setdefault(wish.topic, {})[wish.id] = wish
        return [self._merged(wish, again=before is not None)]

    def _unsubscribe(self, wish: Unsubscribe) -> list[Effect]:
        wishes = self._subscribed.get(wish.topic)
        if wishes is None or (wish.id is not None and wish.id not in wishes):
            raise Invalid(f"cannot unsubscribe from {wish.topic}: this client is not subscribed so; subscribe first")
        if wish.id is None:
            del self._subscribed[wish.topic]
        else:
            self._drop_subscription(wish.topic, wish.id)
        left = self._subscribed.get(wish.topic)
        return [self._merged(next(iter(left.values())), again=True)] if left else [wish]

    def _merged(self, wish: Subscribe, *, again: bool) -> Subscribe:
        wishes = self._subscribed[wish.topic].values()
        lengths = {each.queue_length for each in wishes}
        return replace(
            wish,
            throttle_rate=min(each.throttle_rate for each in wishes),
            queue_length=0 if 0 in lengths else max(lengths),
            fragment_size=min((each.fragment_size for each in wishes if each.fragment_size is not None), default=None),
            compression=max((each.compression for each in wishes), key=COMPRESSIONS.index),
            again=again,
        )

    def _call(self, wish: CallService) -> list[Effect]:
        try:
            self._may("service", wish.service.partition("#")[0])
            if self._calls >= self._limits.calls:
                raise Refused(f"cannot call {wish.service}: {self._calls} calls are open; wait for some answers first")
        except Refused as error:
            return [Send(service_failure(wish, str(error)))]
        self._calls += 1
        return [wish]

    def _offer(self, wish: AdvertiseService) -> list[Effect]:
        if wish.service not in self._offered:
            self._may("offer", wish.service)
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
