"""A service is a Python function bound to a URL: `@service`, its typed parameters, and the registry of all.

Parameters are checked against their annotations before the function runs: `str`, `int`, `float`, `bool`, `dict`, `list`
(also `list[str]` and the like), `X | None`, `Any`; `Path` is an uploaded file; `Request` is filled in by the server. Plain
functions run in a thread, `async` ones on the loop and must not block it (what is heavy asks `workers`). No I/O here.
"""

import inspect
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints, overload

from rapp_hop.errors import HopError, Invalid, Refused
from rapp_hop.hz.text import check_name

DEFAULT_TIMEOUT = 30.0  # seconds
DEFAULT_BODY = 1 * 2**20  # bytes
DEFAULT_CONCURRENCY = 8  # calls of one service at once; more wait
_WORDS = {str: "a text", int: "a whole number", float: "a number", bool: "true or false", dict: "an object"}


@dataclass(frozen=True)
class Request:
    """Who calls, for functions that ask for it by annotation."""

    caller: str  # whom the token names
    service: str
    headers: Mapping[str, str]  # names in lower case
    address: str  # of the peer


@dataclass(frozen=True)
class Parameter:
    """One parameter of a service."""

    name: str
    hint: Any
    required: bool

    def describe(self) -> dict[str, Any]:
        """Return the parameter for `available_services`."""
        return {"name": self.name, "type": _word(self.hint), "required": self.required}


@dataclass(frozen=True)
class Service:
    """A function, its URL and its bounds."""

    name: str
    function: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    request_parameter: str | None
    timeout: float  # seconds
    max_body: int  # bytes
    concurrency: int  # calls at once
    description: str

    @property
    def asynchronous(self) -> bool:
        """Whether it runs on the loop."""
        return inspect.iscoroutinefunction(self.function)

    def bind(self, arguments: Mapping[str, Any], files: Mapping[str, Path], request: Request) -> dict[str, Any]:
        """Return the keyword arguments to call the function with.

        :raises Invalid: naming the parameter that is missing, unknown or of another type
        """
        given: dict[str, Any] = {**arguments, **files}
        known = {parameter.name: parameter for parameter in self.parameters}
        for name in given:
            if name not in known:
                raise Invalid(f"cannot call {self.name}: it has no parameter {name[:40]!r}")
            if (name in files) != (known[name].hint is Path):
                wanted = "a file" if known[name].hint is Path else "no file"
                raise Invalid(f"cannot call {self.name}: parameter {name} must be {wanted}")
        for parameter in self.parameters:
            if parameter.name in given and parameter.name not in files:
                given[parameter.name] = check_value(given[parameter.name], parameter.hint, self.name, parameter.name)
            elif parameter.required and parameter.name not in given:
                raise Invalid(f"cannot call {self.name}: parameter {parameter.name} is missing")
        if self.request_parameter is not None:
            given[self.request_parameter] = request
        return given

    def describe(self) -> dict[str, Any]:
        """Return the service for `available_services`."""
        return {
            "name": self.name,
            "url": f"/hop/{self.name}",
            "description": self.description,
            "parameters": [parameter.describe() for parameter in self.parameters],
            "timeout": self.timeout,
        }


@overload
def service(function: Callable[..., Any]) -> Service: ...


@overload
def service(
    *, name: str = ..., timeout: float = ..., max_body: int = ..., concurrency: int = ...
) -> Callable[[Callable[..., Any]], Service]: ...


def service(
    function: Callable[..., Any] | None = None,
    *,
    name: str = "",
    timeout: float = DEFAULT_TIMEOUT,
    max_body: int = DEFAULT_BODY,
    concurrency: int = DEFAULT_CONCURRENCY,
) -> Service | Callable[[Callable[..., Any]], Service]:
    """Make a service of a function; bare or with bounds.

    :param name: of the URL, the function's when empty
    :param timeout: seconds
    :param max_body: bytes of a request, files included
    :param concurrency: calls at once; the next ones wait, so that one service never takes all threads
    :raises TypeError: when a parameter's annotation is missing or none that can be checked
    """

    def make(function: Callable[..., Any]) -> Service:
        parameters, request_parameter = _parameters(function)
        first_line = (inspect.getdoc(function) or "").partition("\n")[0]
        return Service(
            check_name(name or function.__name__),
            function,
            parameters,
            request_parameter,
            timeout,
            max_body,
            concurrency,
            first_line,
        )

    return make if function is None else make(function)


class ServiceRegistry:
    """All services of one server, by name; it has `available_services` itself."""

    def __init__(self, services: Iterable[Service] = ()) -> None:
        self._services: dict[str, Service] = {}

        @service
        async def available_services() -> dict[str, Any]:
            """List the services with their parameters."""
            return {"services": [item.describe() for item in self]}

        for item in (available_services, *services):
            self.add(item)

    def __iter__(self) -> Iterator[Service]:
        return iter(sorted(self._services.values(), key=lambda item: item.name))

    def add(self, item: Service) -> None:
        """Bind a service to its URL.

        :raises ValueError: when the name is taken
        """
        if item.name in self._services:
            raise ValueError(f"cannot add service {item.name}: the name is taken")
        self._services[item.name] = item

    def get(self, name: str) -> Service:
        """Return the service of that name.

        :raises Refused: with status 404, when there is none
        """
        if name not in self._services:
            raise Refused(f"cannot find a service {name[:70]!r}: see /hop/available_services", 404)
        return self._services[name]


def check_value(value: Any, hint: Any, where: str, name: str) -> Any:
    """Return `value` when it is of the annotated type (a whole number may stand for a `float`).

    :raises Invalid: naming service and parameter
    """
    if hint is Any:
        return value
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return _check_union(value, inner, where, name)
    plain = origin or hint
    if plain is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if plain is type(None):
        plain = types.NoneType
    if not isinstance(value, plain) or (isinstance(value, bool) and plain is not bool):
        raise Invalid(f"cannot call {where}: parameter {name} must be {_word(hint)}")
    if plain is list and inner:
        return [check_value(item, inner[0], where, f"{name}[{place}]") for place, item in enumerate(value)]
    if plain is dict and inner:
        return {key: check_value(item, inner[1], where, f"{name}.{key[:40]}") for key, item in value.items()}
    return value


def _check_union(value: Any, hints: tuple[Any, ...], where: str, name: str) -> Any:
    for hint in hints:
        try:
            return check_value(value, hint, where, name)
        except HopError:
            continue
    raise Invalid(f"cannot call {where}: parameter {name} must be {' or '.join(_word(hint) for hint in hints)}")


def _parameters(function: Callable[..., Any]) -> tuple[tuple[Parameter, ...], str | None]:
    hints = get_type_hints(function)
    found: list[Parameter] = []
    request_parameter = None
    for name, item in inspect.signature(function).parameters.items():
        if name not in hints or item.kind not in (item.POSITIONAL_OR_KEYWORD, item.KEYWORD_ONLY):
            raise TypeError(f"cannot make a service of {function.__name__}: annotate parameter {name}")
        if hints[name] is Request:
            request_parameter = name
            continue
        _check_hint(hints[name], function.__name__, name)
        found.append(Parameter(name, hints[name], item.default is item.empty))
    return tuple(found), request_parameter


def _check_hint(hint: Any, where: str, name: str) -> None:
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType, list, dict):
        for part in inner:
            _check_hint(part, where, name)
    elif hint not in (str, int, float, bool, dict, list, Any, Path, type(None)):
        raise TypeError(f"cannot make a service of {where}: parameter {name} has a type that JSON has not")


def _word(hint: Any) -> str:
    if hint is Path:
        return "a file"
    if hint is Any:
        return "anything"
    if hint is type(None):
        return "null"
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return " or ".join(_word(part) for part in inner)
    if (origin or hint) is list:
        return f"a list, each {_word(inner[0])}" if inner else "a list"
    return _WORDS.get(origin or hint, "an object")


Authenticate = Callable[[str | None], str | None]
"""From the token of a request to the caller it names; None: nobody."""
