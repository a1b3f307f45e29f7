"""rosbridge v2 messages: text in, frozen dataclasses out, and back. No I/O.

Operations and field types as in ROSBRIDGE_PROTOCOL.md of rosbridge_suite (branch ros1), sections 3.3 and 3.4.
"""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import orjson

from rapp_bridge.errors import Invalid

Id = str | int | None

_NAME = re.compile(r"[~/A-Za-z][A-Za-z0-9_/]*")  # wiki.ros.org/Names
TEXT_LIMIT = 500  # characters of an error's text


@dataclass(frozen=True)
class Advertise:
    """A client will publish on `topic`."""

    topic: str
    type: str
    id: Id = None
    latch: bool = False
    queue_size: int = 100


@dataclass(frozen=True)
class Unadvertise:
    """The client publishes on `topic` no longer."""

    topic: str
    id: Id = None


@dataclass(frozen=True)
class Publish:
    """One message for `topic`."""

    topic: str
    msg: dict[str, Any]
    id: Id = None


@dataclass(frozen=True)
class Subscribe:
    """The client wants the messages of `topic`; `throttle_rate` in ms, `queue_length` in messages (0: no limit of its own)."""

    topic: str
    type: str | None = None
    id: Id = None
    throttle_rate: int = 0
    queue_length: int = 0


@dataclass(frozen=True)
class Unsubscribe:
    """The client wants the messages of `topic` no longer."""

    topic: str
    id: Id = None


@dataclass(frozen=True)
class CallService:
    """A call of a ROS service; `timeout` in s, None for the bridge's own."""

    service: str
    args: list[Any] | dict[str, Any]
    id: Id = None
    timeout: float | None = None


@dataclass(frozen=True)
class AdvertiseService:
    """The client answers calls of `service`."""

    service: str
    type: str


@dataclass(frozen=True)
class UnadvertiseService:
    """The client answers calls of `service` no longer."""

    service: str


@dataclass(frozen=True)
class ServiceResponse:
    """The client's answer to one call."""

    service: str
    id: str
    result: bool
    values: Any = None


Message = (
    Advertise | Unadvertise | Publish | Subscribe | Unsubscribe | CallService | AdvertiseService | UnadvertiseService
    | ServiceResponse
)  # fmt: skip


def parse(text: str | bytes) -> dict[str, Any]:
    """Read one frame as a JSON object; raises Invalid."""
    try:
        fields = orjson.loads(text)
    except orjson.JSONDecodeError as error:
        raise Invalid(f"cannot read the message: {error}; send one JSON object per frame") from error
    if not isinstance(fields, dict):
        raise Invalid("cannot read the message: it is no JSON object with an op")
    return fields


def decode(fields: dict[str, Any]) -> Message:
    """Make the message of a client's JSON object; raises Invalid for an unknown op and for fields of a wrong type."""
    reader = _Reader(fields)
    op = reader.text("op")
    decoder = _DECODERS.get(op)
    if decoder is None:
        raise Invalid(f"cannot serve op {op[:100]!r}: this bridge knows {', '.join(sorted(_DECODERS))}")
    return decoder(reader)


class _Reader:
    """Typed access to a message's fields."""

    def __init__(self, fields: dict[str, Any]) -> None:
        self._fields = fields

    def _get(self, name: str, kinds: tuple[type, ...], default: Any) -> Any:
        value = self._fields.get(name)
        value = default if value is None else value
        if value is ...:
            raise Invalid(f"cannot serve the message: field {name} is missing")
        is_flag = isinstance(value, bool)
        if value is not default and (not isinstance(value, kinds) or (is_flag and bool not in kinds)):
            wanted = " or ".join(kind.__name__ for kind in kinds)
            raise Invalid(f"cannot serve the message: field {name} is {type(value).__name__}, not {wanted}")
        return value

    def text(self, name: str) -> str:
        value: str = self._get(name, (str,), ...)
        if not value:
            raise Invalid(f"cannot serve the message: field {name} is empty")
        return value

    def name(self, field: str) -> str:
        value = self.text(field)
        if not _NAME.fullmatch(value):
            raise Invalid(f"cannot serve the message: {field} {value[:100]!r} is no ROS name")
        return value

    def optional_text(self, name: str) -> str | None:
        value: str | None = self._get(name, (str,), None)
        return value

    def id(self) -> Id:
        value: Id = self._get("id", (str, int), None)
        return value

    def count(self, name: str, default: int) -> int:
        value: int = self._get(name, (int,), default)
        if not 0 <= value <= 1_000_000:
            raise Invalid(f"cannot serve the message: field {name} is {value}, outside 0 to 1000000")
        return value

    def flag(self, name: str, default: Any = ...) -> bool:
        value: bool = self._get(name, (bool,), default)
        return value

    def object(self, name: str) -> dict[str, Any]:
        value: dict[str, Any] = self._get(name, (dict,), {})
        return value

    def arguments(self) -> list[Any] | dict[str, Any]:
        value: list[Any] | dict[str, Any] = self._get("args", (list, dict), {})
        return value

    def seconds(self, name: str) -> float | None:
        value: float | None = self._get(name, (int, float), None)
        return value if value is None or value > 0 else None

    def any(self, name: str) -> Any:
        return self._fields.get(name)


_DECODERS: dict[str, Callable[[_Reader], Message]] = {
    "advertise": lambda r: Advertise(r.name("topic"), r.text("type"), r.id(), r.flag("latch", False), r.count("queue_size", 100)),
    "unadvertise": lambda r: Unadvertise(r.name("topic"), r.id()),
    "publish": lambda r: Publish(r.name("topic"), r.object("msg"), r.id()),
    "subscribe": lambda r: Subscribe(
        r.name("topic"), r.optional_text("type"), r.id(), r.count("throttle_rate", 0), r.count("queue_length", 0)
    ),
    "unsubscribe": lambda r: Unsubscribe(r.name("topic"), r.id()),
    "call_service": lambda r: CallService(r.name("service"), r.arguments(), r.id(), r.seconds("timeout")),
    "advertise_service": lambda r: AdvertiseService(r.name("service"), r.text("type")),
    "unadvertise_service": lambda r: UnadvertiseService(r.name("service")),
    "service_response": lambda r: ServiceResponse(r.name("service"), r.text("id"), r.flag("result"), r.any("values")),
}


def _encode(fields: dict[str, Any]) -> bytes:
    try:
        return orjson.dumps(fields)
    except TypeError:  # a ROS string that is no UTF-8, which the escapes of the standard library can carry
        return json.dumps(fields).encode()


def publication(topic: str, msg: Any) -> bytes:
    """A topic's message for a client."""
    return _encode({"op": "publish", "topic": topic, "msg": msg})


def service_result(call: CallService, values: Any, result: bool) -> bytes:
    """The answer to a client's call: `values` are the response's fields, or the error's text when `result` is false."""
    fields = {"op": "service_response", "service": call.service, "values": values, "result": result}
    if call.id is not None:
        fields["id"] = call.id
    return _encode(fields)


def service_request(service: str, request: str, args: Any) -> bytes:
    """A call for the client that advertised `service`; `request` is the id its answer must carry."""
    return _encode({"op": "call_service", "id": request, "service": service, "args": args})


def error_status(text: str, message_id: Id = None) -> bytes:
    """A status of level error (protocol section 3.2.2); a long text is cut, so that no client gets its own frame back."""
    fields: dict[str, Any] = {"op": "status", "level": "error", "msg": text[:TEXT_LIMIT]}
    if message_id is not None:
        fields["id"] = message_id
    return _encode(fields)
