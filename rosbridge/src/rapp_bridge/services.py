"""Services between rospy and clients: calls over pooled persistent connections, and services that clients offer."""

import itertools
import socket
import threading
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import rospy
import rosservice

from rapp_bridge.client import Client
from rapp_bridge.config import Config
from rapp_bridge.conversion import arguments, from_json, service_class, writer
from rapp_bridge.errors import BridgeError, Invalid, Refused, Unreachable
from rapp_bridge.protocol import (
    AdvertiseService,
    CallService,
    ServiceResponse,
    UnadvertiseService,
    service_request,
    service_result,
)


class Calls:
    """Calls of ROS services by clients, each in a worker thread, all bounded in number and time."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._workers = ThreadPoolExecutor(config.calls, thread_name_prefix="call")
        self._free = threading.BoundedSemaphore(config.calls)
        self._lock = threading.Lock()
        self._idle: defaultdict[str, list[Any]] = defaultdict(list)

    def call(self, client: Client, wish: CallService) -> None:
        """Start a call; its answer goes to the client. Raises Refused when too many calls are open already."""
        if not self._free.acquire(blocking=False):
            raise Refused(f"cannot call {wish.service}: {self._config.calls} calls are open already; try again later")
        self._workers.submit(self._run, client, wish)

    def close(self) -> None:
        """Take no more calls and close the idle connections."""
        self._workers.shutdown(wait=False, cancel_futures=True)
        with self._lock:
            for proxy in itertools.chain.from_iterable(self._idle.values()):
                proxy.close()
            self._idle.clear()

    def _run(self, client: Client, wish: CallService) -> None:
        try:
            answer, done = self._answer(wish), True
        except BridgeError as error:
            answer, done = str(error), False
        finally:
            self._free.release()
        client.send(service_result(wish, answer, done))

    def _answer(self, wish: CallService) -> Any:
        name = rospy.resolve_name(wish.service)
        proxy = self._take(name)
        if proxy is not None:
            try:
                return self._through(name, proxy, wish)
            except Unreachable:
                pass  # an idle connection dies when its service is restarted: a fresh one decides
        return self._through(name, self._connect(name), wish)

    def _take(self, name: str) -> Any:
        with self._lock:
            return self._idle[name].pop() if self._idle[name] else None

    def _connect(self, name: str) -> Any:
        try:
            type_name = rosservice.get_service_type(name)
        except (rosservice.ROSServiceException, OSError) as error:
            raise Unreachable(f"cannot call {name}: {error}") from error
        if type_name is None:
            raise Unreachable(f"cannot call {name}: no such service is registered; start its node")
        return rospy.ServiceProxy(name, service_class(type_name), persistent=True)

    def _through(self, name: str, proxy: Any, wish: CallService) -> Any:
        request = arguments(wish.args, proxy.request_class)
        timeout = wish.timeout or self._config.call_timeout
        late = threading.Event()
        timer = threading.Timer(timeout, self._hang_up, (proxy, late))
        timer.daemon = True
        timer.start()
        try:
            response = proxy(request)
        except (rospy.ServiceException, rospy.exceptions.TransportException, OSError) as error:
            proxy.close()
            if late.is_set():
                raise Refused(f"cannot wait for {name}: no answer in {timeout:g} s") from error
            if "responded with an error" in str(error):
                raise Invalid(f"{error}") from error
            raise Unreachable(f"cannot call {name}: {error}") from error
        finally:
            timer.cancel()
        with self._lock:
            self._idle[name].append(proxy)
        return writer(response.__class__)(response)

    @staticmethod
    def _hang_up(proxy: Any, late: threading.Event) -> None:
        """Wake the thread that waits for the answer: rospy knows no time-out of a call."""
        late.set()
        transport = proxy.transport
        if transport is not None and transport.socket is not None:
            try:
                transport.socket.shutdown(socket.SHUT_RDWR)
            except OSError:
                proxy.close()


@dataclass
class _Open:
    """A call of a client's service that waits for its answer."""

    answered: threading.Event = field(default_factory=threading.Event)
    response: ServiceResponse | None = None
    left: bool = False


@dataclass
class _Offered:
    client: Client
    type: str
    service: Any
    open: dict[str, _Open] = field(default_factory=dict)


class Offers:
    """Services that clients offer to ROS; when a client leaves, whoever waits for it is told at once."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._lock = threading.RLock()
        self._offered: dict[str, _Offered] = {}
        self._numbers = itertools.count(1)

    def advertise(self, client: Client, wish: AdvertiseService) -> None:
        """Offer a service; one of the same name is replaced, its waiting callers are told so."""
        cls = service_class(wish.type)
        name = rospy.resolve_name(wish.service)
        with self._lock:
            self._withdraw(name)
            offered = _Offered(client, wish.type, None)
            self._offered[name] = offered
            offered.service = rospy.Service(name, cls, self._handler(name, wish.service, offered, cls))

    def unadvertise(self, client: Client, wish: UnadvertiseService) -> None:
        """Withdraw a service of this client; raises Invalid when it is not this client's."""
        name = rospy.resolve_name(wish.service)
        with self._lock:
            offered = self._offered.get(name)
            if offered is None or offered.client is not client:
                raise Invalid(f"cannot unadvertise {wish.service}: this client does not offer it")
            self._withdraw(name)

    def answer(self, client: Client, response: ServiceResponse) -> None:
        """Give a client's answer to the caller that waits for it; raises Invalid when nobody does."""
        with self._lock:
            offered = self._offered.get(rospy.resolve_name(response.service))
            waiting = offered.open.get(response.id) if offered is not None and offered.client is client else None
            if waiting is None:
                raise Invalid(f"cannot use the answer {response.id}: nobody waits for it any longer")
            waiting.response = response
            waiting.answered.set()

    def forget(self, client: Client) -> None:
        """Withdraw all services of a client."""
        with self._lock:
            for name in [n for n, o in self._offered.items() if o.client is client]:
                self._withdraw(name)

    def _withdraw(self, name: str) -> None:
        offered = self._offered.pop(name, None)
        if offered is None:
            return
        for waiting in offered.open.values():
            waiting.left = True
            waiting.answered.set()
        offered.service.shutdown("the client that offered it has left")

    def _handler(self, name: str, spelling: str, offered: _Offered, cls: Any) -> Callable[[Any], Any]:
        encode = writer(cls._request_class)

        def handle(request: Any) -> Any:
            waiting = _Open()
            number = f"service_request:{name}:{next(self._numbers)}"
            with self._lock:
                if self._offered.get(name) is not offered:
                    raise rospy.ServiceException(f"{name}: its provider has left")
                if len(offered.open) >= self._config.calls:
                    raise rospy.ServiceException(f"{name}: {self._config.calls} calls are open already")
                offered.open[number] = waiting
            try:
                offered.client.send(service_request(spelling, number, encode(request)))
                return self._wait(name, waiting, cls)
            finally:
                with self._lock:
                    offered.open.pop(number, None)

        return handle

    def _wait(self, name: str, waiting: _Open, cls: Any) -> Any:
        if not waiting.answered.wait(self._config.call_timeout):
            raise rospy.ServiceException(f"{name}: no answer in {self._config.call_timeout:g} s")
        response = waiting.response
        if waiting.left or response is None:
            raise rospy.ServiceException(f"{name}: its provider has left")
        values = response.values
        if not response.result and not (isinstance(values, dict) and values):
            raise rospy.ServiceException(str(values or "the provider failed"))
        try:
            return from_json(values or {}, cls._response_class._type, cls._response_class)
        except Invalid as error:
            raise rospy.ServiceException(f"{name}: {error}") from error
