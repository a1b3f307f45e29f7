"""One client's session: frames in, actions on the ROS side, errors back as status messages or service responses."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from rapp_bridge.client import Client
from rapp_bridge.errors import BridgeError
from rapp_bridge.protocol import (
    Advertise,
    AdvertiseService,
    CallService,
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


class TopicSide(Protocol):
    """The topics a session uses; every method raises BridgeError."""

    def advertise(self, client: Client, wish: Advertise) -> None: ...  # noqa: D102
    def unadvertise(self, client: Client, wish: Unadvertise) -> None: ...  # noqa: D102
    def publish(self, client: Client, wish: Publish) -> None: ...  # noqa: D102
    def subscribe(self, client: Client, wish: Subscribe) -> None: ...  # noqa: D102
    def unsubscribe(self, client: Client, wish: Unsubscribe) -> None: ...  # noqa: D102
    def forget(self, client: Client) -> None: ...  # noqa: D102


class CallSide(Protocol):
    """Calls of ROS services."""

    def call(self, client: Client, wish: CallService) -> None: ...  # noqa: D102


class OfferSide(Protocol):
    """Services that clients offer."""

    def advertise(self, client: Client, wish: AdvertiseService) -> None: ...  # noqa: D102
    def unadvertise(self, client: Client, wish: UnadvertiseService) -> None: ...  # noqa: D102
    def answer(self, client: Client, response: ServiceResponse) -> None: ...  # noqa: D102
    def forget(self, client: Client) -> None: ...  # noqa: D102


class Session:
    """The protocol state of one client. A bad frame harms neither its neighbours nor the connection."""

    def __init__(self, client: Client, topics: TopicSide, calls: CallSide, offers: OfferSide) -> None:
        self._client = client
        self._topics = topics
        self._offers = offers
        self._actions: Mapping[type, Callable[[Client, Any], None]] = {
            Advertise: topics.advertise,
            Unadvertise: topics.unadvertise,
            Publish: topics.publish,
            Subscribe: topics.subscribe,
            Unsubscribe: topics.unsubscribe,
            CallService: calls.call,
            AdvertiseService: offers.advertise,
            UnadvertiseService: offers.unadvertise,
            ServiceResponse: offers.answer,
        }

    def receive(self, frame: str | bytes) -> None:
        """Serve one frame."""
        message_id = None
        try:
            fields = parse(frame)
            message_id = fields.get("id") if isinstance(fields.get("id"), str | int) else None
            message = decode(fields)
        except BridgeError as error:
            self._client.send(error_status(str(error), message_id))
            return
        self._serve(message, message_id)

    def _serve(self, message: Message, message_id: str | int | None) -> None:
        try:
            self._actions[type(message)](self._client, message)
        except BridgeError as error:
            if isinstance(message, CallService):
                self._client.send(service_result(message, str(error), False))
            else:
                self._client.send(error_status(str(error), message_id))

    def close(self) -> None:
        """Undo all that the client left behind."""
        self._offers.forget(self._client)
        self._topics.forget(self._client)
