"""Services that clients offer: to ROS through connections on the event loop, to other clients directly."""

import asyncio
import itertools
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

import rospy
from rospy.impl.registration import get_service_manager

from rapp_bridge.blocking import Blocking
from rapp_bridge.client import Client
from rapp_bridge.config import Config
from rapp_bridge.decoding import Raw, decode
from rapp_bridge.encoding import encode
from rapp_bridge.errors import BridgeError, Invalid, Refused, Unreachable
from rapp_bridge.forms import JSON, json_pieces
from rapp_bridge.links import Answer
from rapp_bridge.outgoing import service_request
from rapp_bridge.protocol import AdvertiseService, ServiceResponse, UnadvertiseService
from rapp_bridge.rostypes import service_class
from rapp_bridge.topics import registered


@dataclass(eq=False)
class _Asked:
    """A request that waits for the client's answer."""

    answer: Answer
    timer: asyncio.TimerHandle


@dataclass(eq=False)
class Offered:
    """A service of a client, and the calls that wait for it."""

    client: Client
    spelling: str  # the name as the client wrote it
    cls: Any
    service: Any = None
    waiting: dict[str, _Asked] = field(default_factory=dict)

    def fail_all(self, text: str) -> None:
        """Tell all who wait."""
        left = list(self.waiting.values())
        self.waiting.clear()
        for asked in left:
            asked.timer.cancel()
            asked.answer(Unreachable(f"cannot wait for the answer: {text}"))


class Offers:
    """All services that clients offer, by their global names. When a client leaves, whoever waits for it is told at once.

    Belongs to the event loop's thread.
    """

    def __init__(self, config: Config, blocking: Blocking) -> None:
        self._config = config
        self._blocking = blocking
        self._change = asyncio.Lock()  # held while rospy registers
        self._offered: dict[str, Offered] = {}
        self._numbers = itertools.count(1)

    async def advertise(self, client: Client, wish: AdvertiseService) -> None:
        """Offer a service; one of the same name is replaced, its waiting callers are told so. Raises BridgeError."""
        offered = Offered(client, wish.service, service_class(wish.type))
        name = rospy.resolve_name(wish.service)
        async with self._change:
            await self._withdraw(name, None)
            if get_service_manager().get_service(name) is not None:
                raise Refused(f"cannot advertise {wish.service}: it is the bridge's own; choose another name")
            self._offered[name] = offered
            try:
                offered.service = await self._blocking.run(registered, rospy.Service, name, offered.cls, _unused)
            except Unreachable:
                self._offered.pop(name, None)
                raise

    def unadvertise(self, client: Client, wish: UnadvertiseService) -> Awaitable[None]:
        """Withdraw a service of this client; nothing happens when somebody else has taken the name over."""
        return self._unadvertise(rospy.resolve_name(wish.service), client)

    async def _unadvertise(self, name: str, client: Client) -> None:
        async with self._change:
            await self._withdraw(name, client)

    def abandon(self, client: Client) -> None:
        """The client is gone: all who wait for it fail now, before its services are withdrawn one by one."""
        for offered in self._offered.values():
            if offered.client is client:
                offered.fail_all("its provider has left")

    def answer(self, client: Client, response: ServiceResponse) -> None:
        """Give a client's answer to the caller that waits for it; raises Invalid when nobody does."""
        offered = self._offered.get(rospy.resolve_name(response.service))
        asked = offered.waiting.pop(response.id, None) if offered is not None and offered.client is client else None
        if offered is None or asked is None:
            raise Invalid(f"cannot use the answer {response.id[:100]!r}: nobody waits for it; it came too late, or twice")
        asked.timer.cancel()
        asked.answer(_response(offered, response))

    def find(self, name: str) -> Offered | None:
        """What a client offers under this global name."""
        return self._offered.get(name)

    def ask(self, name: str, cls: Any, request: Raw, seconds: float, answer: Answer) -> None:
        """Send a serialized request to the provider of the moment; `answer` gets the serialized response, or the error."""
        offered = self._offered.get(name)
        if offered is None or offered.cls is not cls:
            answer(Unreachable(f"cannot call {name}: its provider has left"))
        elif len(offered.waiting) >= self._config.requests:
            answer(Refused(f"cannot call {name}: {self._config.requests} calls wait for it; try again later"))
        else:
            self._send(offered, request, seconds, answer)

    def server(self, name: str) -> tuple[Any, Callable[[Raw, Answer], None]] | None:
        """The class of a client's service and what serves its requests, for callers in ROS.

        A caller's connection outlives a provider that leaves and comes again.
        """
        offered = self._offered.get(name)
        if offered is None:
            return None
        cls = offered.cls
        return cls, lambda request, answer: self.ask(name, cls, request, self._config.call_timeout, answer)

    def close(self) -> None:
        """Tell all who wait that the bridge ends."""
        for offered in self._offered.values():
            offered.fail_all("the bridge ends")

    def _send(self, offered: Offered, request: Raw, seconds: float, answer: Answer) -> None:
        try:
            args = json_pieces(decode(request, offered.cls._request_class, JSON))
        except BridgeError as error:
            answer(error)
            return
        number = f"service_request:{offered.spelling}:{next(self._numbers)}"
        timer = asyncio.get_running_loop().call_later(seconds, self._late, offered, number, seconds)
        offered.waiting[number] = _Asked(answer, timer)
        offered.client.send(service_request(offered.spelling, number, args))

    @staticmethod
    def _late(offered: Offered, number: str, seconds: float) -> None:
        asked = offered.waiting.pop(number, None)
        if asked is not None:
            asked.answer(Unreachable(f"cannot wait longer for {offered.spelling}: no answer in {seconds:g} s"))

    async def _withdraw(self, name: str, owner: Client | None) -> None:
        offered = self._offered.get(name)
        if offered is None or owner not in (None, offered.client):
            return
        del self._offered[name]
        offered.fail_all("its provider has left")
        if offered.service is not None:
            try:
                await self._blocking.run(offered.service.shutdown, "withdrawn by its client")
            except rospy.ServiceException as error:
                raise Unreachable(f"cannot unregister {name} at the ROS master: {error}") from error


def _unused(_request: Any) -> None:
    """rospy wants a handler; the requests come in elsewhere."""


def _response(offered: Offered, response: ServiceResponse) -> bytearray | BridgeError:
    """The response message of a client's answer, or the error that it means.

    `result` false with values counts as an answer: roslibpy's clients send it so.
    """
    values = response.values
    if not response.result and not (isinstance(values, dict) and values):
        text = values if values and isinstance(values, str) else "the provider failed"
        return Refused(f"cannot call {offered.spelling}: it answered with an error: {text}")
    try:
        return encode({} if values is None else values, offered.cls._response_class)
    except BridgeError as error:
        return error
