"""Values of JSON or CBOR to ROS bytes, by encoders compiled once per message type.

Value rules of rosbridge v2 on ROS 1: a time is {secs, nsecs} or "now", uint8[] and char[] are base64 text, bytes or a list,
null is NaN, missing fields are defaults, a Header without a stamp is stamped now.
"""

import math
import string
import struct
from collections.abc import Callable, Hashable
from functools import cache
from typing import Any

import pybase64

from rapp_bridge.arrays import Numbers
from rapp_bridge.clock import now
from rapp_bridge.errors import Invalid
from rapp_bridge.rostypes import CODES, OCTETS, fields_of, nested, split_array

Write = Callable[[Any, bytearray], None]
"""Appends a value's bytes; raises `_Off`."""

_LENGTH = struct.Struct("<I")
_BLANKS = dict.fromkeys(map(ord, string.whitespace))
_FLOATS = ("float32", "float64")


class _Off(Exception):  # noqa: N818
    """A value does not fit; the fields on the way to it are added, innermost first, while it rises."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.path: list[str] = []


def encode(values: Any, cls: Any) -> bytearray:
    """The serialized message of an object; missing fields keep their defaults; raises Invalid, naming the field."""
    out = bytearray()
    try:
        _message_writer(cls)(values, out)
    except _Off as off:
        where = "".join([cls._type, *reversed(off.path)])
        raise Invalid(f"cannot fill {where}: {off}") from off
    return out


def encode_arguments(values: list[Any] | dict[str, Any], cls: Any) -> bytearray:
    """The serialized request of a service call, from arguments by position or by name; raises Invalid."""
    if isinstance(values, list):
        if len(values) > len(cls.__slots__):
            raise Invalid(f"cannot call with {len(values)} arguments: {cls._type} has {len(cls.__slots__)}")
        values = dict(zip(cls.__slots__, values, strict=False))
    return encode(values, cls)


def _named(value: Any) -> str:
    """A value's type as JSON's users call it."""
    names = {
        dict: "an object", list: "a list", str: "a string", bool: "a bool", int: "an integer", float: "a float",
        bytes: "bytes", Numbers: "a typed array", type(None): "null",
    }  # fmt: skip
    return names.get(type(value), f"a {type(value).__name__}")


def _shown(value: Any) -> str:
    """A number for a text; Python refuses to write the hugest, which CBOR can bring."""
    return str(value) if abs(value) < 1 << 128 else "it"


@cache
def _message_writer(cls: Hashable) -> Write:
    fields = [(name, _writer(kind), _default(kind)) for name, kind in fields_of(cls)]
    known = {name for name, _, _ in fields}
    stamp_missing = getattr(cls, "_type", "") == "std_msgs/Header"

    def write(values: Any, out: bytearray) -> None:
        if type(values) is not dict:
            raise _Off(f"an object is needed, not {_named(values)}")
        found = 0
        for name, write_field, default in fields:
            if name in values:
                found += 1
                try:
                    write_field(values[name], out)
                except _Off as off:
                    off.path.append("." + name)
                    raise
            elif stamp_missing and name == "stamp":
                write_field("now", out)
            else:
                default(out)
        if found != len(values):
            odd = next(name for name in values if name not in known)
            raise _Off(f"it has no field {odd[:100] if type(odd) is str else _named(odd)}; it has {', '.join(known) or 'none'}")

    return write


def _default(kind: str) -> Callable[[bytearray], None]:
    """Appends what a field holds when it is not given: zeros, but for headers, which are stamped now."""
    if kind.endswith("]"):
        element, size = split_array(kind)
        if size is None:
            return lambda out: out.extend(b"\0\0\0\0")
        write_element = _default(element)

        def write(out: bytearray) -> None:
            for _ in range(size):
                write_element(out)

        return write
    if kind in CODES:
        zero = bytes(struct.calcsize("<" + CODES[kind]))
    elif kind in ("time", "duration"):
        zero = bytes(8)
    elif kind == "string":
        zero = bytes(4)
    else:
        write_message = _message_writer(nested(kind))
        return lambda out: write_message({}, out)
    return lambda out: out.extend(zero)


def _writer(kind: str) -> Write:
    if kind.endswith("]"):
        return _array_writer(*split_array(kind))
    if kind == "bool":
        return _write_bool
    if kind == "string":
        return _write_string
    if kind in _FLOATS:
        return _float_writer(kind)
    if kind in CODES:
        return _integer_writer(kind)
    if kind in ("time", "duration"):
        return _time_writer(kind)
    return _message_writer(nested(kind))


def _write_bool(value: Any, out: bytearray) -> None:
    if type(value) is not bool:
        raise _Off(f"a bool is needed, not {_named(value)}")
    out.append(value)


def _write_string(value: Any, out: bytearray) -> None:
    if type(value) is not str:
        raise _Off(f"a string is needed, not {_named(value)}")
    text = value.encode(errors="surrogatepass")
    out += _LENGTH.pack(len(text))
    out += text


def _limits(kind: str) -> tuple[int, int]:
    bits = 8 * struct.calcsize("<" + CODES[kind])
    return (0, (1 << bits) - 1) if CODES[kind].isupper() else (-(1 << bits - 1), (1 << bits - 1) - 1)


def _integer_writer(kind: str) -> Write:
    pack = struct.Struct("<" + CODES[kind]).pack
    low, high = _limits(kind)

    def write(value: Any, out: bytearray) -> None:
        if type(value) is not int:
            raise _Off(f"an integer is needed, not {_named(value)}")
        if not low <= value <= high:
            raise _Off(f"{_shown(value)} does not fit {kind}, which goes from {low} to {high}")
        out += pack(value)

    return write


def _float_writer(kind: str) -> Write:
    pack = struct.Struct("<" + CODES[kind]).pack

    def write(value: Any, out: bytearray) -> None:
        if value is None:  # as the bridge itself writes NaN
            value = math.nan
        elif type(value) is not float and type(value) is not int:
            raise _Off(f"a number is needed, not {_named(value)}")
        try:
            out += pack(value)
        except (OverflowError, struct.error) as error:
            raise _Off(f"{_shown(value)} does not fit {kind}") from error

    return write


def _time_writer(kind: str) -> Write:
    write_secs = _integer_writer("uint32" if kind == "time" else "int32")
    pack = struct.Struct("<II" if kind == "time" else "<ii").pack

    def write(value: Any, out: bytearray) -> None:
        if value == "now" and kind == "time":
            out += pack(*now())
            return
        if type(value) is not dict or not value.keys() <= {"secs", "nsecs"}:
            raise _Off(f"a {kind} is an object of secs and nsecs")
        secs, nsecs = value.get("secs", 0), value.get("nsecs", 0)
        for part, check in ((secs, write_secs), (nsecs, _write_nsecs)):
            check(part, bytearray())
        seconds, nanoseconds = divmod(secs * 1_000_000_000 + nsecs, 1_000_000_000)
        if kind == "time" and seconds < 0:
            raise _Off("a time is not negative")
        try:
            out += pack(seconds, nanoseconds)
        except struct.error as error:
            raise _Off(f"{seconds} s do not fit a {kind}") from error

    return write


_write_nsecs = _integer_writer("int32")


def _array_writer(element: str, size: int | None) -> Write:
    write_items = _octets_writer() if element in OCTETS else _items_writer(element)

    def write(value: Any, out: bytearray) -> None:
        start = len(out)
        if size is None:
            out += b"\0\0\0\0"
        count = write_items(value, out)
        if size is None:
            _LENGTH.pack_into(out, start, count)
        elif count != size:
            raise _Off(f"{size} elements are needed, not {count}")

    return write


def _items_writer(element: str) -> Callable[[Any, bytearray], int]:
    """Appends the elements of an array and gives their number; lists of numbers are packed as a whole."""
    write_one = _writer(element)
    code = CODES.get(element, "?")
    exact = {int, float} if element in _FLOATS else {int}

    def write(value: Any, out: bytearray) -> int:
        if type(value) is Numbers and code != "?":
            try:
                out += value.packed(code)
            except ValueError as error:
                raise _Off(str(error)) from error
            return len(value)
        if type(value) is not list:
            raise _Off(f"a list is needed, not {_named(value)}")
        if code != "?" and set(map(type, value)) <= exact:
            try:
                out += struct.pack(f"<{len(value)}{code}", *value)
                return len(value)
            except (struct.error, OverflowError):
                pass  # one by one, to name the element that does not fit
        for index, item in enumerate(value):
            try:
                write_one(item, out)
            except _Off as off:
                off.path.append(f"[{index}]")
                raise
        return len(value)

    return write


def _octets_writer() -> Callable[[Any, bytearray], int]:
    write_list = _items_writer("uint8")

    def write(value: Any, out: bytearray) -> int:
        if type(value) is str:
            value = _octets(value)
        if type(value) is bytes:
            out += value
            return len(value)
        return write_list(value, out)

    return write


def _octets(text: str) -> bytes:
    """The bytes of a base64 text, which may be broken into lines (RFC 2045) as Python's encodebytes does."""
    try:
        try:
            return pybase64.b64decode(text, validate=True)
        except ValueError:
            return pybase64.b64decode(text.translate(_BLANKS), validate=True)
    except ValueError as error:
        raise _Off(f"{error} in its base64 text") from error
