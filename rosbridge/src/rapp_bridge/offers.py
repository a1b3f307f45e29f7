"""Services that clients offer: to ROS as rospy services, to other clients directly."""

import itertools
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import rospy

from rapp_bridge.client import Client
from rapp_bridge.config import Config
from rapp_bridge.conversion import from_json, service_class, writer
from rapp_bridge.errors import BridgeError, Invalid, Refused, Unreachable
from rapp_bridge.protocol import AdvertiseService, ServiceResponse, UnadvertiseService, service_request

Answer = Future[ServiceResponse]


@dataclass
class Offered:
    """A service of a client, and the calls that wait for the client's answer."""

    client: Client
    spelling: str  # the name as the client wrote it
    cls: Any
    service: Any = None
    waiting: dict[str, Answer] = field(default_factory=dict)

    def take_waiting(self) -> list[Answer]:
        """All that wait; who takes an answer out of `waiting` is the only one to settle it."""
        left = list(self.waiting.values())
        self.waiting.clear()
        return left


class Offers:
    """All services that clients offer. When a client leaves, whoever waits for it is told at once.

    `advertise` and `unadvertise` talk to the master and block; the others do not. All may be called from any thread.
    """

    def __init__(self, config: Config) -> None:
        self._config = config
        self._change = threading.Lock()  # held while rospy registers
        self._lock = threading.Lock()  # never held while anything waits
        self._offered: dict[str, Offered] = {}
        self._numbers = itertools.count(1)

    def advertise(self, client: Client, wish: AdvertiseService) -> None:
        """Offer a service; one of the same name is replaced, its waiting callers are told so. Raises BridgeError."""
        offered = Offered(client, wish.service, service_class(wish.type))
        name = rospy.resolve_name(wish.service)
        with self._change:
            self._withdraw(name, None)
            with self._lock:
                self._offered[name] = offered
            try:
                offered.service = rospy.Service(name, offered.cls, self._handler(name, offered.cls))
            except (rospy.ROSException, rospy.ServiceException, OSError, ValueError) as error:
                raise Unreachable(f"cannot advertise service {name}: {error}") from error
            finally:
                if offered.service is None:
                    with self._lock:
                        self._offered.pop(name, None)

    def unadvertise(self, client: Client, wish: UnadvertiseService) -> None:
        """Withdraw a service of this client; nothing happens when somebody else has taken the name over."""
        with self._change:
            self._withdraw(rospy.resolve_name(wish.service), client)

    def abandon(self, client: Client) -> None:
        """The client is gone: all who wait for it fail now, before its services are withdrawn one by one."""
        with self._lock:
            left = [answer for o in self._offered.values() if o.client is client for answer in o.take_waiting()]
        for answer in left:
            _fail(answer, "its provider has left")

    def answer(self, client: Client, response: ServiceResponse) -> None:
        """Give a client's answer to the caller that waits for it; raises Invalid when nobody does."""
        with self._lock:
            offered = self._offered.get(rospy.resolve_name(response.service))
            waiting = offered.waiting.pop(response.id, None) if offered is not None and offered.client is client else None
        if waiting is None:
            raise Invalid(f"cannot use the answer {response.id!r}: nobody waits for it; it came too late, or twice")
        if waiting.set_running_or_notify_cancel():
            waiting.set_result(response)

    def find(self, name: str) -> Offered | None:
        """What a client offers under this resolved name."""
        with self._lock:
            return self._offered.get(name)

    @contextmanager
    def asking(self, name: str, offered: Offered, request: Any) -> Iterator[Answer]:
        """Send a request message to the provider; its answer comes in the future, which fails when the provider leaves.

        Raises Refused when too many wait for it already, Unreachable when it has left.
        """
        answer: Answer = Future()
        number = f"service_request:{offered.spelling}:{next(self._numbers)}"
        with self._lock:
            if self._offered.get(name) is not offered:
                raise Unreachable(f"cannot call {name}: its provider has left")
            if len(offered.waiting) >= self._config.requests:
                raise Refused(f"cannot call {name}: {self._config.requests} calls wait for it; try again later")
            offered.waiting[number] = answer
        try:
            fields = writer(offered.cls._request_class)(request)
            offered.client.send(service_request(offered.spelling, number, fields))
            yield answer
        finally:
            with self._lock:
                offered.waiting.pop(number, None)

    def close(self) -> None:
        """Tell all who wait that the bridge ends."""
        with self._lock:
            left = [answer for offered in self._offered.values() for answer in offered.take_waiting()]
        for answer in left:
            _fail(answer, "the bridge ends")

    def _withdraw(self, name: str, owner: Client | None) -> None:
        with self._lock:
            offered = self._offered.get(name)
            if offered is None or owner not in (None, offered.client):
                return
            del self._offered[name]
            left = offered.take_waiting()
        for answer in left:
            _fail(answer, "its provider has left")
        try:
            offered.service.shutdown("withdrawn by its client")
        except rospy.ServiceException as error:
            raise Unreachable(f"cannot unregister {name} at the ROS master: {error}") from error

    def _handler(self, name: str, cls: Any) -> Callable[[Any], Any]:
        """What rospy calls, in a thread of each caller's. It asks for the provider of the moment: a caller's connection
        outlives a provider that leaves and comes again.
        """

        def handle(request: Any) -> Any:
            offered = self.find(name)
            if offered is None or offered.cls is not cls:
                raise rospy.ServiceException("its provider has left")
            try:
                with self.asking(name, offered, request) as answer:
                    return response_of(name, answer.result(self._config.call_timeout), cls)
            except TimeoutError as error:
                raise rospy.ServiceException(f"no answer in {self._config.call_timeout:g} s") from error
            except BridgeError as error:
                raise rospy.ServiceException(str(error)) from error

        return handle


def response_of(name: str, response: ServiceResponse, cls: Any) -> Any:
    """The response message of a client's answer; raises Refused when the client says it failed, Invalid when it is off.

    `result` false with values counts as an answer: roslibpy's clients send it so.
    """
    values = response.values
    if not response.result and not (isinstance(values, dict) and values):
        raise Refused(f"cannot call {name}: it answered with an error: {values or 'the provider failed'}")
    return from_json({} if values is None else values, cls._response_class)


def _fail(answer: Answer, text: str) -> None:
    if answer.set_running_or_notify_cancel():
        answer.set_exception(Unreachable(f"cannot wait for the answer: {text}"))
