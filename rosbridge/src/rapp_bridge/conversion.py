"""ROS messages to JSON values and back, by converters compiled once per message type.

Value rules of rosbridge v2 on ROS 1: time as {secs, nsecs}, uint8[] and char[] as base64 text, NaN and infinities as null.
"""

import base64
import binascii
import math
import time
from collections.abc import Callable, Hashable
from functools import cache
from typing import Any

import genpy
import roslib.message

from rapp_bridge.errors import Invalid

ToJson = Callable[[Any], Any]

_INTEGERS = {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)} | {"byte", "char"}
_BYTES = {"uint8", "char"}


def message_class(type_name: str) -> Any:
    """The class of a message type such as "std_msgs/String"; raises Invalid when it is not built here."""
    return _class(type_name, roslib.message.get_message_class, "message")


def service_class(type_name: str) -> Any:
    """The class of a service type such as "std_srvs/Empty"; raises Invalid when it is not built here."""
    return _class(type_name, roslib.message.get_service_class, "service")


def _class(type_name: str, find: Callable[[str], Any], kind: str) -> Any:
    try:
        found = find(type_name)
    except (ValueError, ImportError) as error:
        raise Invalid(f"cannot use {kind} type {type_name!r}: {error}") from error
    if found is None:
        raise Invalid(f"cannot use {kind} type {type_name!r}: it is not built in this workspace")
    return found


def from_json(values: dict[str, Any], type_name: str, cls: Any) -> Any:
    """The ROS message of a JSON object; missing fields keep their defaults; raises Invalid, naming the field."""
    return _fill(cls(), values, type_name)


def arguments(values: list[Any] | dict[str, Any], cls: Any) -> Any:
    """The request of a service call, from arguments by position or by name; raises Invalid."""
    if isinstance(values, list):
        if len(values) > len(cls.__slots__):
            raise Invalid(f"cannot call with {len(values)} arguments: {cls._type} has {len(cls.__slots__)}")
        values = dict(zip(cls.__slots__, values, strict=False))
    return _fill(cls(), values, cls._type)


@cache
def writer(cls: Hashable) -> ToJson:
    """The compiled converter of one message class, to JSON objects; requests and responses of services included."""
    fields = [(name, _field_writer(kind)) for name, kind in zip(cls.__slots__, cls._slot_types, strict=True)]  # type: ignore[attr-defined]
    return lambda message: {name: write(getattr(message, name)) for name, write in fields}


def _field_writer(kind: str) -> ToJson:
    if kind.endswith("]"):
        element = kind[: kind.index("[")]
        if element in _BYTES:
            return lambda value: base64.b64encode(bytes(value)).decode()
        write = _field_writer(element)
        if element in _INTEGERS or element in ("string", "bool"):
            return list
        return lambda values: [write(value) for value in values]
    if kind in ("float32", "float64"):
        return lambda value: value if math.isfinite(value) else None
    if kind in ("time", "duration"):
        return lambda value: {"secs": value.secs, "nsecs": value.nsecs}
    if kind in _INTEGERS or kind == "string":
        return lambda value: value
    if kind == "bool":
        return bool
    return writer(message_class("std_msgs/Header" if kind == "Header" else kind))


def _fill(message: Any, values: Any, path: str) -> Any:
    if not isinstance(values, dict):
        raise Invalid(f"cannot fill {path}: an object is needed, not {type(values).__name__}")
    kinds = dict(zip(message.__slots__, message._slot_types, strict=True))
    for name, value in values.items():
        if name not in kinds:
            raise Invalid(f"cannot fill {path}: it has no field {name}; it has {', '.join(kinds) or 'none'}")
        setattr(message, name, _read(value, kinds[name], f"{path}.{name}"))
    return message


def _read(value: Any, kind: str, path: str) -> Any:
    if kind.endswith("]"):
        return _read_array(value, kind, path)
    if kind in ("float32", "float64"):
        return _number(value, path, (int, float), float)
    if kind in _INTEGERS:
        return _number(value, path, (int,), int)
    if kind in ("time", "duration"):
        return _read_time(value, kind, path)
    if kind in ("string", "bool"):
        wanted = str if kind == "string" else bool
        if not isinstance(value, wanted):
            raise Invalid(f"cannot fill {path}: a {kind} is needed, not {type(value).__name__}")
        return value
    type_name = "std_msgs/Header" if kind == "Header" else kind
    return _fill(message_class(type_name)(), value, path)


def _number(value: Any, path: str, allowed: tuple[type, ...], make: Callable[[Any], Any]) -> Any:
    if isinstance(value, bool) or not isinstance(value, allowed):
        raise Invalid(f"cannot fill {path}: {make.__name__} is needed, not {type(value).__name__}")
    return make(value)


def _read_time(value: Any, kind: str, path: str) -> Any:
    make = genpy.Time if kind == "time" else genpy.Duration
    if value == "now" and kind == "time":
        return genpy.Time.from_sec(time.time())
    if not isinstance(value, dict) or not set(value) <= {"secs", "nsecs"}:
        raise Invalid(f"cannot fill {path}: a {kind} is an object of secs and nsecs")
    secs = _number(value.get("secs", 0), path, (int,), int)
    return make(secs, _number(value.get("nsecs", 0), path, (int,), int))


def _read_array(value: Any, kind: str, path: str) -> Any:
    element, _, size = kind[:-1].partition("[")
    if element in _BYTES and isinstance(value, str):
        try:
            items: Any = base64.b64decode(value, validate=True)
        except binascii.Error as error:
            raise Invalid(f"cannot fill {path}: {error} in its base64 text") from error
    elif isinstance(value, list):
        items = [_read(item, element, f"{path}[{index}]") for index, item in enumerate(value)]
        items = bytes(items) if element in _BYTES and all(0 <= item < 256 for item in items) else items
    else:
        raise Invalid(f"cannot fill {path}: a list is needed, not {type(value).__name__}")
    if size and len(items) != int(size):
        raise Invalid(f"cannot fill {path}: {size} elements are needed, not {len(items)}")
    return items
