"""JSON that leaves nothing to interpretation.

Rules: UTF-8 without lone surrogates, finite numbers, no key twice in an object, bounded size and depth
(inputs H12, P24 of the project's list of hostile inputs).
"""

import json
import math
from typing import Any

from rapp_hop.errors import Invalid

MAX_DEPTH = 32  # containers inside containers
_ENCODER = json.JSONEncoder(allow_nan=False, ensure_ascii=False)


def loads(data: bytes | str, *, limit: int, depth: int = MAX_DEPTH) -> Any:
    """Return the value that `data` spells.

    :param limit: bytes (characters of a text) allowed
    :raises Invalid: when a rule of this module is broken
    """
    if len(data) > limit:
        raise Invalid(f"cannot read JSON of {len(data)} bytes: at most {limit} are allowed")
    try:
        text = data if isinstance(data, str) else data.decode("utf-8")
        value = _DECODER.decode(text)
    except UnicodeDecodeError:
        raise Invalid("cannot read JSON: it is not UTF-8, send it as UTF-8") from None
    except RecursionError:
        raise Invalid(f"cannot read JSON: nested deeper than {depth}") from None
    except ValueError as error:
        raise Invalid(f"cannot read JSON: {error}") from None
    # Text that came as UTF-8 has half characters only where it spells them, and depth needs brackets.
    if isinstance(data, str) or "\\u" in text or text.count("[") + text.count("{") > depth:
        _check(value, depth)
    return value


def dumps(value: Any) -> str:
    """Return the JSON text of `value`.

    :raises Invalid: when it holds something JSON has not (NaN, bytes, objects, cycles)
    """
    try:
        return _ENCODER.encode(value)
    except (TypeError, ValueError, RecursionError) as error:
        raise Invalid(f"cannot write as JSON: {error}") from None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise ValueError(f"key {twice[:40]!r} stands twice in one object")
    return found


def _no_constant(word: str) -> Any:
    raise ValueError(f"{word} is not a JSON number")


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"number {text[:20]} is too large")
    return number


def _check(value: Any, depth: int) -> None:
    waiting = [(value, 0)]
    while waiting:
        item, level = waiting.pop()
        if isinstance(item, str):
            _check_text(item)
        elif isinstance(item, dict | list):
            if level >= depth:
                raise Invalid(f"cannot read JSON: nested deeper than {depth}")
            parts = [*item.keys(), *item.values()] if isinstance(item, dict) else item
            waiting.extend((part, level + 1) for part in parts)


def _check_text(text: str) -> None:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise Invalid("cannot read JSON: a text holds half a character (lone surrogate)") from None


_DECODER = json.JSONDecoder(object_pairs_hook=_unique, parse_constant=_no_constant, parse_float=_finite)
