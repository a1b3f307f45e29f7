"""Frames from clients to messages, with all their fields checked. No I/O."""

import json
import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import orjson

from rapp_bridge import cbor
from rapp_bridge.errors import Invalid
from rapp_bridge.protocol import (
    COMPRESSIONS,
    LEVELS,
    Advertise,
    AdvertiseService,
    Auth,
    CallService,
    Fragment,
    Id,
    Message,
    Publish,
    ServiceResponse,
    SetLevel,
    Subscribe,
    Unadvertise,
    UnadvertiseService,
    Unsubscribe,
)

_NAME = re.compile(r"[~/A-Za-z][A-Za-z0-9_/]*")  # wiki.ros.org/Names; "/" and "~" alone are namespaces
_COUNT_LIMIT = 1_000_000
_INTEGERS = range(-(1 << 63), 1 << 64)  # what JSON's readers can take back


def parse(frame: str | bytes) -> dict[str, Any]:
    """Read one frame, of JSON or CBOR, as an object; raises Invalid."""
    if type(frame) is bytes and cbor.is_cbor(frame):
        fields = cbor.read(frame)
    else:
        try:
            fields = orjson.loads(frame)
        except orjson.JSONDecodeError as error:
            fields = _with_constants(frame)
            if fields is None:
                raise Invalid(f"cannot read the message: {error}; send one JSON object per frame") from error
    if type(fields) is not dict:
        raise Invalid("cannot read the message: it is no object with an op")
    return fields


def _with_constants(frame: str | bytes) -> Any:
    """The value of a frame with NaN or Infinity, which Python's clients write and JSON does not know; None when that is not all
    that is wrong with it.
    """
    text = frame if isinstance(frame, str) else frame.decode(errors="surrogateescape")
    if "NaN" not in text and "Infinity" not in text:
        return None
    try:
        fields = json.loads(text)
        orjson.dumps(fields)  # refuses what it would not have read: text that is no Unicode, huge integers, deep nesting
    except (ValueError, TypeError, RecursionError):
        return None
    return fields


def decode(fields: dict[str, Any]) -> Message:
    """Make the message of a client's object; raises Invalid for an unknown op and for fields of a wrong type."""
    op = fields.get("op")
    decoder = _DECODERS.get(op) if type(op) is str else None
    if decoder is None:
        op = _text(fields, "op")
        raise Invalid(f"cannot serve op {op[:100]!r}: this bridge knows {', '.join(sorted(_DECODERS))}")
    return decoder(fields)


def _get(fields: dict[str, Any], name: str, kinds: tuple[type, ...], default: Any) -> Any:
    value = fields.get(name)
    if value is None:
        value = default
    if value is ...:
        raise Invalid(f"cannot serve the message: field {name} is missing")
    if value is not default and type(value) not in kinds:
        wanted = " or ".join(kind.__name__ for kind in kinds)
        raise Invalid(f"cannot serve the message: field {name} is {type(value).__name__}, not {wanted}")
    if type(value) is int and value not in _INTEGERS:
        raise Invalid(f"cannot serve the message: field {name} is an integer of more than 64 bits")
    return value


def id_of(fields: dict[str, Any]) -> Id:
    """The id of an object whose other fields may be off; None when it has none, or one that is off too."""
    try:
        return _id(fields)
    except Invalid:
        return None


def _text(fields: dict[str, Any], name: str) -> str:
    value: str = _get(fields, name, (str,), ...)
    if not value:
        raise Invalid(f"cannot serve the message: field {name} is empty")
    return value


def _name(fields: dict[str, Any], field: str) -> str:
    value = _text(fields, field)
    if not _is_name(value):
        raise Invalid(f"cannot serve the message: {field} {value[:100]!r} is no ROS name")
    return value


@lru_cache(4096)
def _is_name(value: str) -> bool:
    return len(value) <= 1000 and _NAME.fullmatch(value) is not None and value.strip("~/") != ""


def _id(fields: dict[str, Any]) -> Id:
    value: Id = _get(fields, "id", (str, int), None)
    return value


def _count(fields: dict[str, Any], name: str, default: int) -> int:
    value: int = _get(fields, name, (int,), default)
    if not 0 <= value <= _COUNT_LIMIT:
        raise Invalid(f"cannot serve the message: field {name} is outside 0 to {_COUNT_LIMIT}")
    return value


def _size(fields: dict[str, Any], name: str) -> int | None:
    value: int | None = _get(fields, name, (int,), None)
    if value is not None and not 0 < value <= 1 << 40:
        raise Invalid(f"cannot serve the message: field {name} is to be positive")
    return value


def _flag(fields: dict[str, Any], name: str, default: Any = ...) -> bool:
    value: bool = _get(fields, name, (bool,), default)
    return value


def _seconds(fields: dict[str, Any], name: str) -> float | None:
    value: float | None = _get(fields, name, (int, float), None)
    return value if value is None or 0 < value < _COUNT_LIMIT else None


def _one_of(fields: dict[str, Any], name: str, known: tuple[str, ...], default: Any) -> Any:
    value = _get(fields, name, (str,), default)
    if value not in known:
        raise Invalid(f"cannot serve the message: {name} {value[:100]!r} is none of {', '.join(known)}")
    return value


def _advertise(f: dict[str, Any]) -> Message:
    return Advertise(_name(f, "topic"), _text(f, "type"), _id(f), _flag(f, "latch", False), _count(f, "queue_size", 100))


def _publish(f: dict[str, Any]) -> Message:
    message = Publish(_name(f, "topic"), _get(f, "msg", (dict,), {}), _id(f))
    if len(f) > 3:
        message.raw = f.get("compression") == "cbor-raw"
        message.latch, message.queue_size = _flag(f, "latch", False), _count(f, "queue_size", 100)
    return message


def _subscribe(f: dict[str, Any]) -> Message:
    return Subscribe(
        _name(f, "topic"),
        _get(f, "type", (str,), None) or None,
        _id(f),
        _count(f, "throttle_rate", 0),
        _count(f, "queue_length", 0),
        _size(f, "fragment_size"),
        _one_of(f, "compression", COMPRESSIONS, "none"),
    )


def _call(f: dict[str, Any]) -> Message:
    service, message_id = _name_and_id(f)
    args = _get(f, "args", (dict, list), {})
    return CallService(service, args, message_id, _seconds(f, "timeout"), _size(f, "fragment_size"))


def _name_and_id(f: dict[str, Any]) -> tuple[str, Id]:
    """A service's name, and the id of its call, which old clients append to the name: "/name#id"."""
    service, message_id = _text(f, "service"), _id(f)
    plain, _, legacy = service.partition("#")
    if not _is_name(plain):
        raise Invalid(f"cannot serve the message: service {service[:100]!r} is no ROS name")
    return service, legacy or None if message_id is None else message_id


def _fragment(f: dict[str, Any]) -> Message:
    return Fragment(
        _get(f, "id", (str, int), ...), _get(f, "num", (int,), ...), _get(f, "total", (int,), ...), _get(f, "data", (str,), ...)
    )


def _auth(f: dict[str, Any]) -> Message:
    texts = {name: _get(f, name, (str,), "") for name in ("token", "mac", "client", "dest", "rand", "level")}
    return Auth(**texts, t=_get(f, "t", (int,), 0), end=_get(f, "end", (int,), 0), id=_id(f))


_DECODERS: dict[str, Callable[[dict[str, Any]], Message]] = {
    "advertise": _advertise,
    "unadvertise": lambda f: Unadvertise(_name(f, "topic"), _id(f)),
    "publish": _publish,
    "subscribe": _subscribe,
    "unsubscribe": lambda f: Unsubscribe(_name(f, "topic"), _id(f)),
    "call_service": _call,
    "advertise_service": lambda f: AdvertiseService(_name(f, "service"), _text(f, "type"), _id(f)),
    "unadvertise_service": lambda f: UnadvertiseService(_name(f, "service"), _id(f)),
    "service_response": lambda f: ServiceResponse(_name(f, "service"), _text(f, "id"), _flag(f, "result"), f.get("values")),
    "fragment": _fragment,
    "set_level": lambda f: SetLevel(_one_of(f, "level", LEVELS, ...), _id(f)),
    "auth": _auth,
}
