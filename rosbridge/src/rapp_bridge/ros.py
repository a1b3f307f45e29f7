"""The ROS side as the sessions see it: carries out the effects of a session."""

import asyncio
from collections.abc import Callable
from typing import Any

import rospy

from rapp_bridge.blocking import Blocking
from rapp_bridge.calls import Calls
from rapp_bridge.client import Client
from rapp_bridge.config import Config
from rapp_bridge.conversion import arguments, writer
from rapp_bridge.errors import Bug, Unreachable
from rapp_bridge.offers import Offered, Offers, response_of
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
from rapp_bridge.topics import Topics


class Ros:
    """What asks the master runs in threads, in order for each client; all else at once on the event loop."""

    def __init__(self, config: Config, topics: Topics, calls: Calls, offers: Offers, blocking: Blocking) -> None:
        self._config = config
        self._topics = topics
        self._calls = calls
        self._offers = offers
        self._blocking = blocking
        self._slow: dict[type, Callable[[Client, Any], None]] = {
            Advertise: topics.advertise,
            Unadvertise: topics.unadvertise,
            Subscribe: topics.subscribe,
            Unsubscribe: topics.unsubscribe,
            AdvertiseService: offers.advertise,
            UnadvertiseService: offers.unadvertise,
        }

    async def perform(self, client: Client, effect: Message) -> None:
        """Carry out any effect but a call; raises BridgeError."""
        if isinstance(effect, ServiceResponse):
            self._offers.answer(client, effect)
        elif isinstance(effect, Publish):
            if not self._topics.advertised(client, effect.topic):
                await self._blocking.run(self._topics.advertise, client, Advertise(effect.topic, ""))
            self._topics.publish(effect)
        elif action := self._slow.get(type(effect)):
            await self._blocking.run(action, client, effect)
        else:
            raise Bug(f"cannot perform {type(effect).__name__}: report this")

    async def call(self, wish: CallService) -> dict[str, Any]:
        """Call a service, of a ROS node or of a client; gives the response's fields; raises BridgeError in bounded time."""
        name = rospy.resolve_name(wish.service)
        offered = self._offers.find(name)
        if offered is None:
            return await self._calls.call(name, wish.args, wish.timeout)
        return await self._ask(name, offered, wish)

    def abandon(self, client: Client) -> None:
        """The client is gone: who waits for its answers is told now; the session's closing effects do the rest."""
        self._offers.abandon(client)

    async def _ask(self, name: str, offered: Offered, wish: CallService) -> dict[str, Any]:
        seconds = wish.timeout or self._config.call_timeout
        request = arguments(wish.args, offered.cls._request_class)
        with self._offers.asking(name, offered, request) as answer:
            try:
                response = await asyncio.wait_for(asyncio.wrap_future(answer), seconds)
            except TimeoutError as error:
                raise Unreachable(f"cannot wait longer for {name}: no answer in {seconds:g} s") from error
        fields: dict[str, Any] = writer(offered.cls._response_class)(response_of(name, response, offered.cls))
        return fields
