"""The typed parameters of a service: from annotations, checked against what comes, described for people and programs. Pure.

Annotations: `str`, `int`, `float`, `bool`, `dict`, `list` (also `list[str]`, `dict[str, int]` and the like), `X | None`,
`Any`, `Literal`; `Path` (or `Path | None`) is a file.
"""

import inspect
import math
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from rapp_hop.errors import HopError, Invalid

_WORDS = {str: "a text", int: "a whole number", float: "a number", bool: "true or false", dict: "an object"}
_SCHEMAS = {str: "string", int: "integer", float: "number", bool: "boolean", dict: "object", list: "array", type(None): "null"}
_TRUTH = {"true": True, "1": True, "false": False, "0": False, "": False}


@dataclass(frozen=True)
class Parameter:
    """One parameter of a service."""

    name: str
    hint: Any
    required: bool
    default: Any = None

    @property
    def takes_file(self) -> bool:
        """Whether it is a file."""
        return Path in _kinds(self.hint)

    def describe(self) -> dict[str, Any]:
        """Return the parameter for `available_services`."""
        return {"name": self.name, "type": word(self.hint), "required": self.required}


def parameters_of(function: Callable[..., Any], request_type: type) -> tuple[tuple[Parameter, ...], str | None]:
    """Return a function's parameters, and the name of the one that takes the request.

    :raises TypeError: when an annotation is missing or none that can be checked
    """
    hints = get_type_hints(function)
    found: list[Parameter] = []
    request_parameter = None
    for name, item in inspect.signature(function).parameters.items():
        if name not in hints or item.kind not in (item.POSITIONAL_OR_KEYWORD, item.KEYWORD_ONLY):
            raise TypeError(f"cannot make a service of {function.__name__}: annotate parameter {name}")
        if hints[name] is request_type:
            request_parameter = name
            continue
        _check_hint(hints[name], function.__name__, name)
        required = item.default is item.empty
        found.append(Parameter(name, hints[name], required, None if required else item.default))
    return tuple(found), request_parameter


def check_value(value: Any, hint: Any, where: str, name: str) -> Any:
    """Return `value` when it is of the annotated type (a whole number may stand for a `float`) and finite.

    :raises Invalid: naming service and parameter
    """
    if type(value) is float and not math.isfinite(value):
        raise Invalid(f"cannot call {where}: parameter {name} must be a finite number")
    if hint is Any or (type(value) is hint and hint is not list and hint is not dict):
        return value
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return _check_union(value, inner, where, name)
    if origin is Literal:
        return _check_literal(value, inner, where, name)
    plain = origin or hint
    if plain is float and isinstance(value, int) and not isinstance(value, bool):
        return _as_float(value, where, name)
    if not isinstance(value, plain) or (isinstance(value, bool) and plain is not bool):
        raise Invalid(f"cannot call {where}: parameter {name} must be {word(hint)}")
    if plain is list and inner:
        return [check_value(item, inner[0], where, f"{name}[{place}]") for place, item in enumerate(value)]
    if plain is dict and inner:
        return {key: check_value(item, inner[1], where, f"{name}.{key[:40]}") for key, item in value.items()}
    return value


def value_from_text(text: str, hint: Any) -> Any:
    """Return what a text of a web form or query means for a parameter; the text itself when it means nothing else.

    Whether the value fits is for `check_value` to say.
    """
    kinds = _kinds(hint)
    if str in kinds or Any in kinds:
        return text
    if type(None) in kinds and text == "":
        return None
    if bool in kinds and text.lower() in _TRUTH:
        return _TRUTH[text.lower()]
    for kind in (int, float):
        if kind in kinds and len(text) <= 40 and "_" not in text:  # Python's own way to write numbers
            try:
                return kind(text)
            except ValueError:
                continue
    return text


def accepts(hint: Any, kind: type) -> bool:
    """Tell whether an annotation takes values of a plain kind."""
    kinds = _kinds(hint)
    return Any in kinds or kind in kinds


def schema(hint: Any) -> dict[str, Any]:
    """Return the JSON Schema of an annotation (draft 2020-12, which OpenAPI 3.1 speaks)."""
    origin, inner = get_origin(hint), get_args(hint)
    if hint is Any:
        return {}
    if hint is Path:
        return {"type": "string", "format": "binary", "contentMediaType": "application/octet-stream"}
    if origin in (Union, types.UnionType):
        return {"anyOf": [schema(part) for part in inner]}
    if origin is Literal:
        return {"enum": list(inner)}
    found: dict[str, Any] = {"type": _SCHEMAS[origin or hint]}
    if inner and origin is list:
        found["items"] = schema(inner[0])
    if inner and origin is dict:
        found["additionalProperties"] = schema(inner[1])
    return found


def known_hint(hint: Any) -> bool:
    """Tell whether an annotation is one of those that this module reads."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType, list):
        return all(known_hint(part) for part in inner)
    if origin is dict:
        return inner[0] is str and known_hint(inner[1])
    if origin is Literal:
        return all(isinstance(item, str | int) for item in inner)
    return hint in (str, int, float, bool, dict, list, Any, Path, type(None))


def word(hint: Any) -> str:
    """Return an annotation in words."""
    if hint is Path:
        return "a file"
    if hint is Any:
        return "anything"
    if hint is type(None):
        return "null"
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return " or ".join(word(part) for part in inner)
    if origin is Literal:
        return "one of " + ", ".join(repr(item) for item in inner)
    if (origin or hint) is list:
        return f"a list, each {word(inner[0])}" if inner else "a list"
    return _WORDS.get(origin or hint, "an object")


def _kinds(hint: Any) -> frozenset[Any]:
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return frozenset().union(*(_kinds(part) for part in inner))
    if origin is Literal:
        return frozenset(type(item) for item in inner)
    return frozenset({origin or hint})


def _as_float(value: int, where: str, name: str) -> float:
    try:
        return float(value)
    except OverflowError:
        raise Invalid(f"cannot call {where}: parameter {name} is too large a number") from None


def _check_union(value: Any, hints: tuple[Any, ...], where: str, name: str) -> Any:
    for hint in hints:
        try:
            return check_value(value, hint, where, name)
        except HopError:
            continue
    raise Invalid(f"cannot call {where}: parameter {name} must be {' or '.join(word(hint) for hint in hints)}")


def _check_literal(value: Any, choices: tuple[Any, ...], where: str, name: str) -> Any:
    for choice in choices:
        if type(value) is type(choice) and value == choice:
            return value
    raise Invalid(f"cannot call {where}: parameter {name} must be {word(Literal[choices])}")


def _check_hint(hint: Any, where: str, name: str) -> None:
    if not known_hint(hint):
        raise TypeError(f"cannot make a service of {where}: parameter {name} has a type that JSON has not")


def texts_to_values(texts: Mapping[str, Any], parameters: Mapping[str, Parameter]) -> dict[str, Any]:
    """Return the arguments that the texts of a web form or query mean; a repeated name stands for a list."""
    found: dict[str, Any] = {}
    for name, text in texts.items():
        hint = parameters[name].hint if name in parameters else Any
        items = get_args(hint) if get_origin(hint) is list else ()
        if isinstance(text, list):
            found[name] = [value_from_text(item, items[0] if items else Any) for item in text]
        elif items and str not in _kinds(hint):
            found[name] = [value_from_text(text, items[0])]
        else:
            found[name] = value_from_text(text, hint)
    return found
