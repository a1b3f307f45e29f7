"""ROS messages to JSON values and back, by converters compiled once per message type.

Value rules of rosbridge v2 on ROS 1: time as {secs, nsecs}, uint8[] and char[] as base64 text, NaN and infinities as null
(orjson writes them so), a Header without a stamp is stamped now.
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
import rospy

from rapp_bridge.errors import Invalid

Convert = Callable[[Any], Any]

_SIZES = {f"int{bits}": (-(1 << bits - 1), (1 << bits - 1) - 1) for bits in (8, 16, 32, 64)}
_SIZES |= {f"uint{bits}": (0, (1 << bits) - 1) for bits in (8, 16, 32, 64)}
_SIZES |= {"byte": _SIZES["int8"], "char": _SIZES["uint8"]}
_FLOATS = ("float32", "float64")
_BYTES = ("uint8", "char")


class _Off(Exception):  # noqa: N818
    """A value does not fit; the fields on the way to it are added, innermost first, while it rises."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.path: list[str] = []


def message_class(type_name: str) -> Any:
    """The class of a message type such as "std_msgs/String"; raises Invalid when it is not built here."""
    return _class(type_name, roslib.message.get_message_class, "message")


def service_class(type_name: str) -> Any:
    """The class of a service type such as "std_srvs/Empty"; raises Invalid when it is not built here."""
    return _class(type_name, roslib.message.get_service_class, "service")


def _class(type_name: str, find: Convert, kind: str) -> Any:
    try:
        found = find(type_name)
    except (ValueError, ImportError) as error:
        raise Invalid(f"cannot use {kind} type {type_name!r}: {error}; give it as package/Name") from error
    if found is None:
        raise Invalid(f"cannot use {kind} type {type_name!r}: it is not built in this workspace")
    return found


def from_json(values: Any, cls: Any) -> Any:
    """The ROS message of a JSON object; missing fields keep their defaults; raises Invalid, naming the field."""
    try:
        return reader(cls)(values)
    except _Off as off:
        where = "".join([cls._type, *reversed(off.path)])
        raise Invalid(f"cannot fill {where}: {off}") from off


def arguments(values: list[Any] | dict[str, Any], cls: Any) -> Any:
    """The request of a service call, from arguments by position or by name; raises Invalid."""
    if isinstance(values, list):
        if len(values) > len(cls.__slots__):
            raise Invalid(f"cannot call with {len(values)} arguments: {cls._type} has {len(cls.__slots__)}")
        values = dict(zip(cls.__slots__, values, strict=False))
    return from_json(values, cls)


@cache
def writer(cls: Hashable) -> Convert:
    """The compiled converter of a message class to JSON objects; requests and responses of services included."""
    fields = [(name, _field_writer(kind)) for name, kind in _slots(cls)]
    plain = [name for name, write in fields if write is _same]
    others = [(name, write) for name, write in fields if write is not _same]
    if not others:
        return lambda message: {name: getattr(message, name) for name in plain}
    return lambda message: {
        name: getattr(message, name) if write is _same else write(getattr(message, name)) for name, write in fields
    }


@cache
def reader(cls: Hashable) -> Convert:
    """The compiled converter of JSON objects to a message class; it raises a private error that `from_json` translates."""
    fields = {name: _field_reader(kind) for name, kind in _slots(cls)}
    stamped = getattr(cls, "_type", "") == "std_msgs/Header"

    def fill(values: Any) -> Any:
        if type(values) is not dict:
            raise _Off(f"an object is needed, not {_named(values)}")
        message = cls()  # type: ignore[operator]
        for name, value in values.items():
            read = fields.get(name)
            if read is None:
                raise _Off(f"it has no field {name[:100]}; it has {', '.join(fields) or 'none'}")
            try:
                setattr(message, name, read(value))
            except _Off as off:
                off.path.append("." + name)
                raise
        if stamped and "stamp" not in values:
            message.stamp = _now()
        return message

    return fill


def _slots(cls: Any) -> list[tuple[str, str]]:
    return list(zip(cls.__slots__, cls._slot_types, strict=True))


def _nested(kind: str) -> Any:
    return message_class("std_msgs/Header" if kind == "Header" else kind)


def _same(value: Any) -> Any:
    return value


def _write_time(value: Any) -> dict[str, int]:
    return {"secs": value.secs, "nsecs": value.nsecs}


def _write_bytes(value: Any) -> str:
    return base64.b64encode(bytes(value)).decode()


def _field_writer(kind: str) -> Convert:
    if kind.endswith("]"):
        element = kind[: kind.index("[")]
        if element in _BYTES:
            return _write_bytes
        write = _field_writer(element)
        if element == "bool":
            return lambda values: list(map(bool, values))
        return _same if write is _same else lambda values: list(map(write, values))
    if kind in ("time", "duration"):
        return _write_time
    if kind in _SIZES or kind in _FLOATS or kind in ("string", "bool"):
        return _same
    return writer(_nested(kind))


def _field_reader(kind: str) -> Convert:
    if kind.endswith("]"):
        return _array_reader(kind)
    if kind in _SIZES:
        return _integer_reader(kind)
    if kind in _FLOATS:
        return _read_float
    if kind in ("string", "bool"):
        return _exact_reader(kind, str if kind == "string" else bool)
    if kind in ("time", "duration"):
        return _read_time if kind == "time" else _read_duration
    return reader(_nested(kind))


def _named(value: Any) -> str:
    """A JSON value's type as JSON's users call it."""
    names = {dict: "an object", list: "a list", str: "a string", bool: "a bool", int: "an integer", float: "a float"}
    return names.get(type(value), "null")


def _exact_reader(kind: str, wanted: type) -> Convert:
    def read(value: Any) -> Any:
        if type(value) is not wanted:
            raise _Off(f"a {kind} is needed, not {_named(value)}")
        return value

    return read


def _integer_reader(kind: str) -> Convert:
    low, high = _SIZES[kind]

    def read(value: Any) -> Any:
        if type(value) is not int:
            raise _Off(f"an integer is needed, not {_named(value)}")
        if not low <= value <= high:
            raise _Off(f"{value} does not fit {kind}, which goes from {low} to {high}")
        return value

    return read


def _read_float(value: Any) -> float:
    if type(value) is float or type(value) is int:
        return float(value)
    if value is None:  # as the bridge itself writes NaN
        return math.nan
    raise _Off(f"a number is needed, not {_named(value)}")


_SECONDS = {"time": _integer_reader("uint32"), "duration": _integer_reader("int32")}
_NANOSECONDS = _integer_reader("int32")


def _read_time(value: Any) -> Any:
    return _now() if value == "now" else _time_of(value, "time", genpy.Time)


def _read_duration(value: Any) -> Any:
    return _time_of(value, "duration", genpy.Duration)


def _time_of(value: Any, kind: str, make: Any) -> Any:
    if type(value) is not dict or not value.keys() <= {"secs", "nsecs"}:
        raise _Off(f"a {kind} is an object of secs and nsecs")
    secs, nsecs = _SECONDS[kind](value.get("secs", 0)), _NANOSECONDS(value.get("nsecs", 0))
    if kind == "time" and secs + nsecs / 1e9 < 0:
        raise _Off("a time is not negative")
    return make(secs, nsecs)


def _now() -> Any:
    if rospy.rostime.is_rostime_initialized():
        return rospy.get_rostime()
    return genpy.Time(*divmod(time.time_ns(), 1_000_000_000))


def _array_reader(kind: str) -> Convert:
    element, _, size = kind[:-1].partition("[")
    read = _field_reader(element)
    as_bytes = element in _BYTES

    def read_array(value: Any) -> Any:
        if as_bytes and type(value) is str:
            items: Any = _from_base64(value)
        elif type(value) is list:
            items = bytes(_each(read, value)) if as_bytes else _each(read, value)
        else:
            raise _Off(f"a list is needed, not {_named(value)}")
        if size and len(items) != int(size):
            raise _Off(f"{size} elements are needed, not {len(items)}")
        return items

    return read_array


def _each(read: Convert, values: list[Any]) -> list[Any]:
    items: list[Any] = []
    try:
        items.extend(map(read, values))  # on failure, what was read before stays in `items`
    except _Off as off:
        off.path.append(f"[{len(items)}]")
        raise
    return items


def _from_base64(text: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError) as error:
        raise _Off(f"{error} in its base64 text") from error
