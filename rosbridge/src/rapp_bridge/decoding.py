"""ROS bytes to values for JSON or CBOR, by decoders compiled once per message type; no message object stands in between.

A decoder is generated as Python source: runs of fixed-size fields are read by one struct, nested messages are read in place,
and arrays of numbers and of bytes stay what they are in the message.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from rapp_bridge.errors import Invalid
from rapp_bridge.rostypes import CODES, OCTETS, fields_of, nested, split_array

Raw = bytes | bytearray
"""One serialized ROS message, without its length."""


@dataclass(frozen=True)
class Form:
    """How an encoding wants its arrays; each function gets the message, where the array begins, and its length."""

    name: str
    octets: Callable[[Raw, int, int], Any]
    numbers: Callable[[str], Callable[[Raw, int, int], Any]]  # for a number type


def decode(raw: Raw, cls: Any, form: Form) -> dict[str, Any]:
    """The fields of a serialized message of this class; raises Invalid when the bytes are of no such message."""
    try:
        fields: dict[str, Any]
        fields, end = _compiled(cls, form)(raw, 0)
    except (struct.error, ValueError) as error:
        raise Invalid(f"cannot read a message as {cls._type}: {error}") from error
    if end != len(raw):
        raise Invalid(f"cannot read a message as {cls._type}: it has {len(raw)} bytes, not {end}")
    return fields


Decoder = Callable[[Raw, int], tuple[Any, int]]


@cache
def _compiled(cls: Any, form: Form) -> Decoder:
    program = _Program(form)
    return program.compile(program.message(cls))


@cache
def _element(kind: str, form: Form) -> Decoder:
    program = _Program(form)
    return program.compile(program.value(kind))


def _each(decoder: Decoder, raw: Raw, position: int, count: int) -> tuple[list[Any], int]:
    if count > len(raw):  # an element may be empty, so its bytes alone would not end the loop
        raise ValueError(f"an array of {count} elements")
    values = []
    for _ in range(count):
        value, position = decoder(raw, position)
        values.append(value)
    return values, position


class _Program:
    """The source of one decoder: statements in order, and the expression of the value that they read.

    In the source `b` is the message and `p` the position in it.
    """

    def __init__(self, form: Form) -> None:
        self._form = form
        self._lines: list[str] = []
        self._names: dict[str, Any] = {"each": _each, "octets": form.octets}
        self._count = 0
        self._run: list[tuple[str, str]] = []  # struct code and variable of fixed-size values not yet read

    def compile(self, expression: str) -> Decoder:
        self._flush()
        source = "\n ".join(["def decoder(b, p):", *self._lines, f"return {expression}, p"])
        exec(source, self._names)
        decoder: Decoder = self._names["decoder"]
        return decoder

    def message(self, cls: Any) -> str:
        items = [f"{name!r}: {self.value(kind)}" for name, kind in fields_of(cls)]
        return "{" + ", ".join(items) + "}"

    def value(self, kind: str) -> str:
        if kind.endswith("]"):
            return self._array(*split_array(kind))
        if kind in CODES:
            return self._number(CODES[kind])
        if kind in ("time", "duration"):
            code = "I" if kind == "time" else "i"
            return f'{{"secs": {self._number(code)}, "nsecs": {self._number(code)}}}'
        if kind == "string":
            return self._read(f"str(b[p : p + {self._length()}], 'utf-8', 'replace')", "len_")
        return self.message(nested(kind))

    def _array(self, element: str, size: int | None) -> str:
        if size is None:
            self._length()
        else:
            self._flush()
            self._lines.append(f"len_ = {size}")
        if element in OCTETS:
            return self._read("octets(b, p, len_)", "len_")
        if element == "bool":
            return self._read("[bit != 0 for bit in b[p : p + len_]]", "len_")
        if element in CODES:
            self._names["numbers_" + element] = self._form.numbers(element)
            return self._read(f"numbers_{element}(b, p, len_)", f"len_ * {struct.calcsize('<' + CODES[element])}")
        self._names[f"element_{self._count}"] = _element(element, self._form)
        variable = self._variable()
        self._lines.append(f"{variable}, p = each(element_{variable[1:]}, b, p, len_)")
        return variable

    def _variable(self) -> str:
        self._count += 1
        return f"v{self._count - 1}"

    def _number(self, code: str) -> str:
        variable = self._variable()
        self._run.append((code, variable))
        return variable

    def _length(self) -> str:
        """Read the length of what follows, together with the fixed-size values before it."""
        self._run.append(("I", "len_"))
        self._flush()
        return "len_"

    def _flush(self) -> None:
        if self._run:
            layout = struct.Struct("<" + "".join(code for code, _ in self._run))
            name = f"unpack_{len(self._lines)}"
            self._names[name] = layout.unpack_from
            variables = ", ".join(variable for _, variable in self._run)
            self._lines += [f"{variables}, = {name}(b, p)", f"p += {layout.size}"]
            self._run.clear()

    def _read(self, expression: str, size: str) -> str:
        variable = self._variable()
        self._lines += [f"{variable} = {expression}", f"p += {size}"]
        return variable
