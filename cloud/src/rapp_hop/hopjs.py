"""The hopjs encoding of the Hop client for Node.js and browsers (3.7): `2.I1.1S1.x` is the arguments 1 and "x". Pure."""

import math
from datetime import UTC, datetime
from typing import Any
from urllib.parse import unquote

from rapp_hop import strict_json
from rapp_hop.bigloo import UNDEFINED
from rapp_hop.errors import Invalid

MAX_VALUES = 64
_PLAIN = {"U": UNDEFINED, "Z": None, "T": True, "F": False}


def loads(text: str) -> list[Any]:
    """Return the arguments; dates as ISO 8601 texts.

    :raises Invalid: when the text is broken
    """
    count, place = _number(text, 0)
    if count > MAX_VALUES:
        raise Invalid(f"cannot read hopjs arguments: at most {MAX_VALUES} are allowed")
    values: list[Any] = []
    for _ in range(count):
        mark = text[place : place + 1]
        if mark in _PLAIN and mark:
            values.append(_PLAIN[mark])
            place += 1
            continue
        length, start = _number(text, place + 1)
        place = start + length
        if place > len(text):
            raise Invalid("cannot read hopjs arguments: cut off")
        values.append(_value(mark, text[start:place]))
    if place != len(text):
        raise Invalid("cannot read hopjs arguments: something follows their end")
    return values


def _number(text: str, place: int) -> tuple[int, int]:
    dot = text.find(".", place, place + 10)
    if dot < 0 or not text[place:dot].isdecimal():
        raise Invalid("cannot read hopjs arguments: a length is missing")
    return int(text[place:dot]), dot + 1


def _value(mark: str, text: str) -> Any:
    try:
        if mark in "IND" and "_" in text:  # Python's own, no number elsewhere
            raise ValueError("no number")
        match mark:
            case "I":
                return int(text)
            case "N":
                return _finite(float(text))
            case "S":
                return text
            case "s":
                return unquote(text, errors="strict")
            case "D":
                return datetime.fromtimestamp(float(text) / 1000, UTC).isoformat(timespec="milliseconds")
            case "J":
                return strict_json.loads(text, limit=len(text))
            case "j":
                return strict_json.loads(unquote(text, errors="strict"), limit=len(text))
    except (ValueError, OverflowError, OSError):
        raise Invalid(f"cannot read hopjs arguments: {text[:40]!r} is none of kind {mark}") from None
    raise Invalid(f"cannot read hopjs arguments: unknown kind {mark!r}")


def _finite(number: float) -> float:
    if not math.isfinite(number):
        raise ValueError("not finite")
    return number
