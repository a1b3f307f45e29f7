"""ROS types by name, and what their fields are."""

from functools import cache
from typing import Any

import genpy
import roslib.message

from rapp_bridge.errors import Invalid

CODES = {
    "bool": "?",
    "int8": "b",
    "byte": "b",
    "uint8": "B",
    "char": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
"""Type of a number to its code of the struct module."""

OCTETS = ("uint8", "char")
"""Types whose arrays are byte strings."""


@cache
def message_class(type_name: str) -> Any:
    """The class of a message type such as "std_msgs/String"; raises Invalid when it is not built here."""
    return _class(type_name, roslib.message.get_message_class, "message")


@cache
def service_class(type_name: str) -> Any:
    """The class of a service type such as "std_srvs/Empty"; raises Invalid when it is not built here."""
    return _class(type_name, roslib.message.get_service_class, "service")


def _class(type_name: str, find: Any, kind: str) -> Any:
    try:
        found = find(type_name)
    except (ValueError, ImportError) as error:
        raise Invalid(f"cannot use {kind} type {type_name[:100]!r}: {error}; give it as package/Name") from error
    if found is None:
        raise Invalid(f"cannot use {kind} type {type_name[:100]!r}: it is not built in this workspace")
    return found


def fields_of(cls: Any) -> list[tuple[str, str]]:
    """Names and types of a message class's fields, in the order of serialization."""
    return list(zip(cls.__slots__, cls._slot_types, strict=True))


def nested(kind: str) -> Any:
    """The class of a field that is a message."""
    return message_class("std_msgs/Header" if kind == "Header" else kind)


def has_header(cls: Any) -> bool:
    """Whether messages of this class begin with a header, whose seq the publisher counts."""
    return issubclass(cls, genpy.Message) and bool(getattr(cls, "_has_header", False))


def split_array(kind: str) -> tuple[str, int | None]:
    """Element type and length of an array type; the length is None when it varies."""
    element, _, size = kind[:-1].partition("[")
    return element, int(size) if size else None
