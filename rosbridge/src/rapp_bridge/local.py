"""Services of the bridge itself, for clients and for ROS nodes alike, and the acceptor of all callers from ROS."""

import asyncio
import io
import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

import genpy
import rospy
from rospy.impl.registration import get_service_manager
from rospy.impl.tcpros_service import convert_return_to_response

from rapp_bridge.access import EVERYTHING, Access
from rapp_bridge.blocking import Blocking
from rapp_bridge.config import Config
from rapp_bridge.decoding import Form, Raw, decode
from rapp_bridge.encoding import encode
from rapp_bridge.errors import BridgeError, Bug, Invalid, Refused, Unreachable
from rapp_bridge.links import Answer, CallerLink, Serve, Welcome
from rapp_bridge.offers import Offers

_log = logging.getLogger(__name__)

PLAIN = Form("plain", lambda raw, start, size: bytes(raw[start : start + size]), lambda kind: _no_numbers)
"""Fields as Python has them; our own services have no arrays of numbers in their requests."""


def _no_numbers(_raw: Raw, _start: int, _count: int) -> Any:
    raise ValueError("an array of numbers")


Provide = Callable[[dict[str, Any], Access], Awaitable[dict[str, Any]]]
"""A service: fields of the request, and what the caller may use, to fields of the response; raises BridgeError."""


@dataclass(frozen=True)
class Local:
    """A service of the bridge."""

    cls: Any
    provide: Provide


class Locals:
    """The services of the bridge, by their global names. Belongs to the event loop's thread."""

    def __init__(self, config: Config, blocking: Blocking, offers: Offers) -> None:
        self._limit = config.response_limit
        self._blocking = blocking
        self._offers = offers
        self._services: dict[str, Local] = {}
        self._working: set[asyncio.Task[None]] = set()

    async def add(self, name: str, local: Local) -> None:
        """Offer a service, in ROS too."""
        self._services[name] = local
        await self._blocking.run(rospy.Service, name, local.cls, lambda request: None)

    def find(self, name: str) -> Local | None:
        """The bridge's service of this name."""
        return self._services.get(name)

    def serve(self, local: Local, request: Raw, access: Access, answer: Answer) -> None:
        """Serve a serialized request; `answer` gets the serialized response, or the error."""
        task = asyncio.get_running_loop().create_task(self._serve(local, request, access, answer))
        self._working.add(task)
        task.add_done_callback(self._working.discard)

    async def _serve(self, local: Local, request: Raw, access: Access, answer: Answer) -> None:
        outcome: bytearray | BridgeError = Bug("cannot serve this; see the bridge's log")
        try:
            fields = decode(request, local.cls._request_class, PLAIN)
            outcome = encode(await local.provide(fields, access), local.cls._response_class)
        except BridgeError as error:
            outcome = error
        finally:
            answer(outcome)

    def accept(self, header: dict[str, str], transport: Any) -> Welcome:
        """A caller in ROS has connected; see `node.Acceptor`."""
        name, md5sum = header.get("service", ""), header.get("md5sum", "*")
        found = self._server(name)
        if found is None:
            raise Unreachable(f"cannot serve {name}: it is not offered here")
        cls, serve = found
        if md5sum not in ("*", cls._md5sum):
            raise Invalid(f"cannot serve {name} with md5sum {md5sum}: it is {cls._type}, md5sum {cls._md5sum}")
        ours = {
            "callerid": rospy.get_name(), "type": cls._type, "md5sum": cls._md5sum,
            "request_type": cls._request_class._type, "response_type": cls._response_class._type,
        }  # fmt: skip
        if header.get("probe") == "1":
            return Welcome(ours, None)
        is_persistent = header.get("persistent", "").lower() in ("1", "true")
        return Welcome(ours, CallerLink(transport, serve, self._limit, is_persistent=is_persistent))

    def _server(self, name: str) -> tuple[Any, Serve] | None:
        local = self._services.get(name)
        if local is not None:
            return local.cls, lambda request, answer: self.serve(local, request, EVERYTHING, answer)
        return self._offers.server(name) or self._rospys(name)

    def _rospys(self, name: str) -> tuple[Any, Serve] | None:
        """A service that rospy itself has registered for every node, such as that of log levels."""
        service = get_service_manager().get_service(name)
        if service is None:
            return None

        def serve(request: Raw, answer: Answer) -> None:
            outcome: list[bytes | BridgeError] = [Bug(f"cannot serve {name}; see the bridge's log")]
            self._blocking.background(lambda: outcome.append(_by_rospy(service, request)), lambda: answer(outcome[-1]))

        return service.service_class, serve


def _by_rospy(service: Any, request: Raw) -> bytes | BridgeError:
    buffer = io.BytesIO()
    try:
        response = service.handler(service.request_class().deserialize(bytes(request)))
        convert_return_to_response(response, service.response_class).serialize(buffer)
    except (rospy.ServiceException, genpy.DeserializationError, genpy.SerializationError) as error:
        return Refused(f"cannot serve {service.resolved_name}: {error}")
    return buffer.getvalue()
