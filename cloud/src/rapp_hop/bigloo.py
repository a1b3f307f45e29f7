"""Bigloo's serialisation, in which Hop clients write values (`hop-encoding: hop`, `application/x-hop`). Pure.

Read by shape, as the class hashes of JavaScript's objects differ from build to build: an instance without fields is `{}`,
one that begins with a keyword an object, one with a vector an array, and so on. `undefined` is `UNDEFINED`. Written are the
kinds that decode everywhere: text, numbers, truth, null, and vectors of them.
"""

import math
import struct
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any, Final
from urllib.parse import unquote_to_bytes

from rapp_hop.errors import Invalid

MAX_BYTES = 4 * 2**20
MAX_DEPTH = 32
MAX_ITEMS = 200_000
_TYPED = {b"u8": "B", b"s8": "b", b"u16": "H", b"s16": "h", b"u32": "I", b"s32": "i", b"u64": "Q", b"s64": "q", b"f32": "f",
          b"f64": "d"}  # fmt: skip


class _Undefined:
    """JavaScript's undefined."""

    def __repr__(self) -> str:
        return "undefined"


UNDEFINED: Final = _Undefined()


class Keyword(str):
    """A Bigloo keyword, the name of a property."""


def loads(data: bytes, *, limit: int = MAX_BYTES) -> Any:
    """Return the value: JSON's kinds, `bytes` for typed vectors of octets, `UNDEFINED`; dates as ISO 8601 texts.

    :raises Invalid: when it is broken, too long or too deep
    """
    if len(data) > limit:
        raise Invalid(f"cannot read {len(data)} bytes of Bigloo: at most {limit} are allowed")
    reader = _Reader(data)
    try:
        value = reader.whole()
    except (IndexError, struct.error, ValueError, OverflowError, OSError) as error:
        raise Invalid(f"cannot read Bigloo's serialisation: {error}") from None
    return value


class _Reader:
    """One pass over the bytes."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._place = 0
        self._depth = 0
        self._items = 0
        self._octets = 0
        self._known: dict[int, Any] = {}
        self._marks: dict[int, Callable[[], Any]] = {
            ord("="): self._definition, ord("#"): lambda: self._known[self._index()],
            ord("'"): self._item, ord(":"): lambda: Keyword(self._text(self._item())),
            ord('"'): self._string, ord("`"): self._string, ord("%"): self._escaped,
            ord("T"): lambda: True, ord("F"): lambda: False, ord(";"): lambda: UNDEFINED, ord("."): lambda: None,
            ord("-"): lambda: -self._size(), ord("f"): self._float,
            ord("z"): self._long, ord("E"): self._long, ord("L"): self._long,
            ord("a"): self._character, ord("u"): self._character, ord("U"): self._string,
            ord("["): self._vector, ord("("): self._list, ord("^"): self._pairs, ord("h"): self._typed,
            ord("d"): lambda: self._date(1), ord("D"): lambda: self._date(10**9),
            ord("X"): self._item, ord("O"): self._instance,
        }  # fmt: skip

    def whole(self) -> Any:
        if self._data[self._place : self._place + 1] == b"c":
            self._place += 1
            self._size()
        value = self._plain(self._item(), 0)
        if self._place != len(self._data):
            raise Invalid("cannot read Bigloo's serialisation: something follows its end")
        return value

    def _item(self) -> Any:
        self._items += 1
        self._depth += 1
        if self._depth > MAX_DEPTH * 4 or self._items > MAX_ITEMS:
            raise Invalid("cannot read Bigloo's serialisation: too deep or too many items")
        mark = self._data[self._place]
        read = self._marks.get(mark)
        if read is None:
            value: Any = self._size()
        else:
            self._place += 1
            value = read()
        self._depth -= 1
        return value

    def _size(self) -> int:
        length = self._data[self._place]
        if length > 16:
            raise Invalid(f"cannot read Bigloo's serialisation: unknown mark {length:#x}")
        return int.from_bytes(self._take(length, 1), "big")

    def _take(self, length: int, skip: int = 0) -> bytes:
        start = self._place + skip
        if start + length > len(self._data):
            raise Invalid("cannot read Bigloo's serialisation: cut off")
        self._place = start + length
        return self._data[start : start + length]

    def _count(self) -> int:
        count = self._size()
        if count > len(self._data) - self._place:
            raise Invalid("cannot read Bigloo's serialisation: more items than bytes")
        return count

    def _index(self) -> int:
        index = self._item()
        if type(index) is not int or index not in self._known:
            raise Invalid("cannot read Bigloo's serialisation: a reference to nothing")
        return int(index)

    def _definition(self) -> Any:
        index = self._item()
        if type(index) is not int:
            raise Invalid("cannot read Bigloo's serialisation: a definition without number")
        self._known[index] = None  # a value that holds itself has no end in JSON
        self._known[index] = self._item()
        return self._known[index]

    def _string(self) -> bytes:
        return self._take(self._size())

    def _escaped(self) -> bytes:
        return unquote_to_bytes(self._string())

    def _text(self, value: Any) -> str:
        if not isinstance(value, bytes | str):
            raise Invalid("cannot read Bigloo's serialisation: a name that is no text")
        self._unfold(1, len(value))
        return value.decode("utf-8") if isinstance(value, bytes) else str(value)

    def _digits(self) -> bytes:
        text = self._string()
        if b"_" in text:  # Python's own, no number elsewhere
            raise Invalid("cannot read Bigloo's serialisation: a number that is none")
        return text

    def _float(self) -> float:
        return float(self._digits())

    def _long(self) -> int:
        return int(self._digits()[:400])

    def _character(self) -> str:
        found = chr(self._size())
        if "\ud800" <= found <= "\udfff":
            raise Invalid("cannot read Bigloo's serialisation: half a character (lone surrogate)")
        return found

    def _vector(self) -> list[Any]:
        return [self._item() for _ in range(self._count())]

    def _list(self) -> list[Any] | None:
        found = [self._item() for _ in range(self._count())]
        if found and found[-1] is None:
            found.pop()
        return found

    def _pairs(self) -> list[Any]:
        found = []
        for _ in range(self._count()):
            found.append(self._item())
            self._item()
        return found

    def _typed(self) -> "_Octets | list[Any]":
        count, width = self._count(), self._size()
        kind = self._item()
        code = _TYPED.get(kind) if isinstance(kind, bytes) else None
        if code is None or struct.calcsize(code) != width:
            raise Invalid("cannot read Bigloo's serialisation: an unknown kind of vector")
        data = self._take(count * width)
        return _Octets(data) if code == "B" else list(struct.unpack(f">{count}{code}", data))

    def _date(self, per_second: int) -> str:
        moment = datetime.fromtimestamp(int(self._digits()) / per_second, UTC)
        return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")

    def _instance(self) -> Any:
        payload = self._item()
        self._item()  # the hash of its class, once more
        fields = payload[1:] if isinstance(payload, list) else []  # the first is the hash
        self._unfold(len(fields))
        if fields and isinstance(fields[0], Keyword):
            if len(fields) % 2:
                raise Invalid("cannot read Bigloo's serialisation: a property without value")
            return {self._text(name): value for name, value in zip(fields[::2], fields[1::2], strict=True)}
        return fields[0] if fields else {}

    def _plain(self, value: Any, depth: int) -> Any:
        if depth > MAX_DEPTH:
            raise Invalid("cannot read Bigloo's serialisation: too deep")
        self._unfold(1, len(value) if isinstance(value, bytes | str) else 0)
        if isinstance(value, _Octets):
            return bytes(value)
        if isinstance(value, bytes):
            return value.decode("utf-8")
        if isinstance(value, list):
            return [self._plain(item, depth + 1) for item in value]
        if isinstance(value, dict):
            return {key: self._plain(item, depth + 1) for key, item in value.items()}
        if isinstance(value, float) and not math.isfinite(value):
            raise Invalid("cannot read Bigloo's serialisation: a number that is not finite")
        return str(value) if isinstance(value, Keyword) else value

    def _unfold(self, items: int, octets: int = 0) -> None:
        """Count what references may repeat: with them few bytes stand for endless many items, or long texts."""
        self._items += items
        self._octets += octets
        if self._items > MAX_ITEMS or self._octets > MAX_BYTES:
            raise Invalid("cannot read Bigloo's serialisation: too many items, or too long when unfolded")


class _Octets(bytes):
    """A vector of octets, to be told from a text."""


def dumps(value: Any) -> bytes:
    """Return the serialisation of a text, number, truth, null or a list of them.

    :raises Invalid: for anything else: objects need the receiver's own class hashes
    """
    if value is None:
        return b"."
    if value is UNDEFINED:
        return b";"
    if isinstance(value, bool):
        return b"T" if value else b"F"
    if isinstance(value, int):
        return _sized(value) if value >= 0 else b"-" + _sized(-value)
    if isinstance(value, float):
        text = repr(value).encode()
        return b"f" + _sized(len(text)) + text
    if isinstance(value, str):
        data = value.encode()
        return b'"' + _sized(len(data)) + data
    if isinstance(value, list):
        return b"[" + _sized(len(value)) + b"".join(dumps(item) for item in value)
    raise Invalid(f"cannot write {type(value).__name__} for a Hop server: send texts, numbers, lists, or JSON")


def _sized(number: int) -> bytes:
    length = (number.bit_length() + 7) // 8
    if length > 16:
        raise Invalid("cannot write a number of more than 16 bytes for a Hop server")
    return bytes([length]) + number.to_bytes(length, "big")
