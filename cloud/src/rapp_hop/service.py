"""A service is a Python function bound to a URL: `@service` and its typed parameters (`registry` holds all of a server).

Plain functions run in a thread, `async` ones on the loop and must not block it, `heavy` ones in worker processes. The
parameters are checked before the function runs (`parameters`); one annotated with `Request` is filled in by the server.
No I/O here.
"""

import functools
import inspect
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, overload

from rapp_hop.errors import Invalid
from rapp_hop.hz.text import check_name
from rapp_hop.parameters import Parameter, check_value, parameters_of

DEFAULT_TIMEOUT = 30.0  # seconds
MAX_TIMEOUT = 24 * 3600.0  # seconds
DEFAULT_BODY = 1 * 2**20  # bytes
DEFAULT_CONCURRENCY = 8  # calls of one service at once; more wait
BASE = "/hop/"
_PATH = re.compile(r"/hop/[a-z][a-z0-9_]{0,63}(/[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}){0,7}", re.ASCII)


@dataclass(frozen=True)
class Request:
    """Who calls, for functions that ask for it by annotation."""

    caller: str  # whom the token names
    service: str
    headers: Mapping[str, str]  # names in lower case
    address: str  # of the peer
    method: str = "POST"
    path: str = ""


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
    path: str = ""  # of its URL
    ttl: int | None = None  # calls until it is gone
    lifetime: float | None = None  # seconds until it is gone
    heavy: bool = False  # runs in a worker process
    blank: Mapping[str, Any] = field(default_factory=dict)  # see `service`

    @functools.cached_property
    def asynchronous(self) -> bool:
        """Whether it runs on the loop."""
        return inspect.iscoroutinefunction(self.function)

    @functools.cached_property
    def known(self) -> Mapping[str, Parameter]:
        """The parameters by name."""
        return {parameter.name: parameter for parameter in self.parameters}

    def bind(self, arguments: Mapping[str, Any], files: Mapping[str, Path], request: Request) -> dict[str, Any]:
        """Return the keyword arguments to call the function with.

        :raises Invalid: naming the parameter that is missing, unknown or of another type
        """
        given: dict[str, Any] = {**arguments, **files}
        known = self.known
        for name in given:
            if name not in known:
                raise Invalid(f"cannot call {self.name}: it has no parameter {name[:40]!r}")
            if name in files and not known[name].takes_file:
                raise Invalid(f"cannot call {self.name}: parameter {name} must be no file")
        for parameter in self.parameters:
            name = parameter.name
            if name in given and name not in files:
                given[name] = check_value(given[name], parameter.hint, self.name, name)
            elif parameter.required and name not in given:
                raise Invalid(f"cannot call {self.name}: parameter {name} is missing")
        if self.request_parameter is not None:
            given[self.request_parameter] = request
        return given

    def resource(self, name: str) -> Path:
        """Return the path of a file that lies beside the service's source (Hop's `svc.resource`)."""
        return Path(inspect.getfile(self.function)).resolve().parent / name

    def describe(self) -> dict[str, Any]:
        """Return the service for `available_services`."""
        return {
            "name": self.name,
            "url": self.path,
            "description": self.description,
            "parameters": [parameter.describe() for parameter in self.parameters],
            "timeout": self.timeout,
        }


@overload
def service(function: Callable[..., Any]) -> Service: ...


@overload
def service(
    *,
    name: str = ...,
    path: str = ...,
    timeout: float = ...,
    max_body: int = ...,
    concurrency: int | None = ...,
    ttl: int | None = ...,
    lifetime: float | None = ...,
    heavy: bool = ...,
    blank: Mapping[str, Any] | None = ...,
) -> Callable[[Callable[..., Any]], Service]: ...


def service(
    function: Callable[..., Any] | None = None,
    *,
    name: str = "",
    path: str = "",
    timeout: float = DEFAULT_TIMEOUT,
    max_body: int = DEFAULT_BODY,
    concurrency: int | None = None,
    ttl: int | None = None,
    lifetime: float | None = None,
    heavy: bool = False,
    blank: Mapping[str, Any] | None = None,
) -> Service | Callable[[Callable[..., Any]], Service]:
    """Make a service of a function; bare or with bounds.

    :param name: the function's when empty
    :param path: of its URL, /hop/<name> when empty
    :param timeout: seconds of one call
    :param max_body: bytes of a request, files included
    :param concurrency: calls at once; the next ones wait, so that one service never takes all threads
    :param ttl: number of calls after which it is gone
    :param lifetime: seconds after its binding when it is gone
    :param heavy: run it in worker processes, as many as `concurrency` (default: one for each core); a function of a module
    :param blank: what clients of the original platform get beside `error` when the call fails
    :raises TypeError: when a parameter's annotation is missing or none that can be checked
    :raises ValueError: when a bound is out of range
    """

    def make(function: Callable[..., Any]) -> Service:
        parameters, request_parameter = parameters_of(function, Request)
        _check_bounds(function, timeout, ttl, lifetime)
        if heavy:
            _check_heavy(function)
        title = check_name(name or function.__name__)
        return Service(
            title,
            function,
            parameters,
            request_parameter,
            timeout,
            max_body,
            concurrency or (len(os.sched_getaffinity(0)) if heavy else DEFAULT_CONCURRENCY),
            (inspect.getdoc(function) or "").partition("\n")[0],
            check_path(path or BASE + title),
            ttl,
            lifetime,
            heavy,
            dict(blank or {}),
        )

    return make if function is None else make(function)


def check_path(path: str) -> str:
    """Return `path` when it may be that of a service's URL.

    :raises Invalid: when it is not /hop/ and plain names
    """
    if not _PATH.fullmatch(path) or ".." in path:
        raise Invalid(f"cannot use the path {path[:70]!r}: write {BASE} and plain names")
    return path


def _check_bounds(function: Callable[..., Any], timeout: float, ttl: int | None, lifetime: float | None) -> None:
    if not 0 < timeout <= MAX_TIMEOUT or (ttl is not None and ttl < 1) or (lifetime is not None and not lifetime > 0):
        raise ValueError(f"cannot make a service of {function.__name__}: timeout, ttl and lifetime must be above zero")


def _check_heavy(function: Callable[..., Any]) -> None:
    if inspect.iscoroutinefunction(function) or "<locals>" in function.__qualname__ or function.__module__ == "__main__":
        raise TypeError(f"cannot run {function.__name__} in a worker: it must be a plain function of an importable module")


Authenticate = Callable[[str | None], str | None]
"""From the token of a request to the caller it names; None: nobody."""
