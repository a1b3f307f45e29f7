"""The ROS side as the sessions see it: carries out the effects of a session."""

from collections.abc import Awaitable, Callable
from typing import Any

import rospy

from rapp_bridge.calls import Calls, Done
from rapp_bridge.client import Client
from rapp_bridge.config import Config
from rapp_bridge.decoding import Raw, decode
from rapp_bridge.encoding import encode_arguments
from rapp_bridge.errors import BridgeError
from rapp_bridge.forms import JSON, json_pieces
from rapp_bridge.local import Locals
from rapp_bridge.offers import Offers
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
)
from rapp_bridge.publications import Publications
from rapp_bridge.subscriptions import Subscriptions

Waiting = Awaitable[None] | None
"""What is not done at once, because the master has to be asked, is to be awaited before the client's next message."""


class Ros:
    """All that clients can have done. Belongs to the event loop's thread."""

    def __init__(
        self, config: Config, publications: Publications, subscriptions: Subscriptions, calls: Calls, offers: Offers, own: Locals
    ) -> None:
        self._config = config
        self._calls = calls
        self._offers = offers
        self._own = own
        self.publish: Callable[[Client, Publish], Waiting] = publications.publish
        self._actions: dict[type, Callable[[Client, Any], Waiting]] = {
            Advertise: publications.advertise,
            Unadvertise: publications.unadvertise,
            Subscribe: subscriptions.subscribe,
            Unsubscribe: subscriptions.unsubscribe,
            AdvertiseService: offers.advertise,
            UnadvertiseService: offers.unadvertise,
            ServiceResponse: offers.answer,
        }

    def perform(self, client: Client, effect: Message) -> Waiting:
        """Carry out any effect but a publication or a call; raises BridgeError."""
        return self._actions[type(effect)](client, effect)

    def call(self, client: Client, wish: CallService, done: Done) -> None:
        """Call a service, of a ROS node, of a client, or of the bridge; `done` gets the outcome in bounded time."""
        name = rospy.resolve_name(wish.service.partition("#")[0])
        seconds = wish.timeout or self._config.call_timeout
        if (own := self._own.find(name)) is not None:
            self._ask(own.cls, wish, done, lambda request, answer: self._own.serve(own, request, client.access, answer))
        elif (offered := self._offers.find(name)) is not None:
            cls = offered.cls
            self._ask(cls, wish, done, lambda request, answer: self._offers.ask(name, cls, request, seconds, answer))
        else:
            self._calls.call(name, wish.args, seconds, done)

    def abandon(self, client: Client) -> None:
        """The client is gone: who waits for its answers is told now; the session's closing effects do the rest."""
        self._offers.abandon(client)

    @staticmethod
    def _ask(cls: Any, wish: CallService, done: Done, serve: Callable[[Raw, Any], None]) -> None:
        """Call a service within this process, with the same checks as one of ROS."""

        def answer(outcome: bytes | bytearray | BridgeError) -> None:
            if isinstance(outcome, BridgeError):
                done(outcome)
                return
            try:
                done(json_pieces(decode(outcome, cls._response_class, JSON)))
            except BridgeError as error:
                done(error)

        try:
            serve(encode_arguments(wish.args, cls._request_class), answer)
        except BridgeError as error:
            done(error)
