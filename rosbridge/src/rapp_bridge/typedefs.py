"""Descriptions of types, as rosapi gives them to clients."""

from typing import Any

import genpy

from rapp_bridge.rostypes import CODES, fields_of, message_class, service_class, split_array

_TIMES = ("time", "duration")


def message_typedefs(type_name: str) -> list[dict[str, Any]]:
    """A message type and all types in it, itself first; raises Invalid when it is not built here."""
    return _recursive(message_class(type_name))


def request_typedefs(type_name: str) -> list[dict[str, Any]]:
    """As `message_typedefs`, of a service type's request."""
    return _recursive(service_class(type_name)._request_class)


def response_typedefs(type_name: str) -> list[dict[str, Any]]:
    """As `message_typedefs`, of a service type's response."""
    return _recursive(service_class(type_name)._response_class)


def full_text(type_name: str) -> str:
    """A message type's definition with those of all types in it, as gendeps --cat prints them."""
    return str(message_class(type_name)._full_text)


def _recursive(cls: Any) -> list[dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    _add(cls, found)
    return list(found.values())


def _add(cls: Any, found: dict[str, dict[str, Any]]) -> None:
    found[cls._type] = typedef = _typedef(cls)
    for kind in typedef["fieldtypes"]:
        if kind in found or kind in CODES or kind == "string":
            continue
        if kind in _TIMES:
            found[kind] = _time_typedef(kind)
        else:
            _add(message_class(kind), found)


def _typedef(cls: Any) -> dict[str, Any]:
    names, types, lengths, examples = [], [], [], []
    defaults = cls()
    for name, kind in fields_of(cls):
        element, size = split_array(kind) if kind.endswith("]") else (kind, -1)
        names.append(name)
        types.append("std_msgs/Header" if element == "Header" else element)
        lengths.append(0 if size is None else size)
        value = getattr(defaults, name)
        is_composed = isinstance(value, genpy.Message | genpy.TVal)
        examples.append("[]" if kind.endswith("]") else "{}" if is_composed else str(value))
    constants = {
        name: value
        for name, value in vars(cls).items()
        if not name.startswith("_") and name not in names and isinstance(value, bool | int | float | str)
    }
    return {
        "type": cls._type, "fieldnames": names, "fieldtypes": types, "fieldarraylen": lengths, "examples": examples,
        "constnames": list(constants), "constvalues": [str(value) for value in constants.values()],
    }  # fmt: skip


def _time_typedef(kind: str) -> dict[str, Any]:
    return {
        "type": kind, "fieldnames": ["secs", "nsecs"], "fieldtypes": ["int32", "int32"], "fieldarraylen": [-1, -1],
        "examples": ["0", "0"], "constnames": [], "constvalues": [],
    }  # fmt: skip
