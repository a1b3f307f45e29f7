"""HOP's requests and answers as values. Pure: no socket, no disk.

A *form* is one way to write a call on the wire; `forms` tells which one a request is written in. Each reads the call, and
writes its result or error back.
"""

from collections.abc import AsyncGenerator, Mapping
from dataclasses import dataclass
from mmap import mmap
from pathlib import Path
from typing import Any, BinaryIO, Protocol

from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_hop.service import Service

MAX_JSON = 4 * 2**20  # bytes of arguments
STATUS: dict[str, int] = {Refused.kind: 403, Unreachable.kind: 503, Invalid.kind: 400, Bug.kind: 500}
STATUSES = frozenset({400, 401, 403, 404, 405, 408, 409, 413, 414, 429, 431, 500, 503})

Body = bytes | mmap


@dataclass(frozen=True, slots=True)
class WireRequest:
    """An HTTP request as it came, its body whole (in memory, or mapped from a file when it is long)."""

    method: str
    path: str  # as it stands on the wire, up to the question mark
    headers: Mapping[str, str]  # names in lower case
    body: Body
    query: str = ""  # as it stands on the wire


@dataclass(frozen=True, slots=True)
class OpenFile:
    """A part of a file to send; whoever sends the answer closes it."""

    file: BinaryIO
    start: int  # bytes
    length: int  # bytes


@dataclass(frozen=True, slots=True)
class WireAnswer:
    """An HTTP answer to send; a body that is a path is that file, a generator comes in pieces."""

    status: int
    content_type: str
    body: bytes | Path | OpenFile | AsyncGenerator[bytes, None]
    headers: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Upload:
    """A file that came with a call, not yet on the disk."""

    parameter: str
    data: bytes | memoryview
    suffix: str  # of the sender's file name, such as .ogg; nothing else of that name is kept


@dataclass(frozen=True, slots=True)
class Call:
    """The named arguments of a call, and its files."""

    arguments: Mapping[str, Any]
    uploads: tuple[Upload, ...] = ()


class Form(Protocol):
    """One way to write calls."""

    def read(self, request: WireRequest, service: Service) -> Call:
        """Return the call.

        :raises HopError: when the request is broken, or does not fit the service
        """

    def write(self, result: Any, service: Service) -> WireAnswer:
        """Return the answer for a result that JSON can hold.

        :raises Bug: when it cannot
        """

    def write_error(self, error: HopError, service: Service | None) -> WireAnswer:
        """Return the answer for an error; the service, where it was found."""


def status_of(error: HopError) -> int:
    """Return the HTTP status of an error: that of its kind, unless it brings a better one."""
    return error.status if error.status in STATUSES else STATUS[error.kind]


def headers_of(error: HopError) -> tuple[tuple[str, str], ...]:
    """Return the headers that belong to an error: whoever was turned away before anything ran may safely come again."""
    return (("Retry-After", str(error.retry_after)),) if error.reason == TURNED_AWAY else ()


TURNED_AWAY = "turned away"
"""`HopError.reason` of a call that was not begun."""


def turned_away(message: str) -> Unreachable:
    """Return the error of a call that was not begun and may safely come again."""
    error = Unreachable(message, 503)
    error.reason = TURNED_AWAY
    return error


def suffix_of(file_name: str) -> str:
    """Return of a sender's file name what may be kept: a short plain suffix, or nothing."""
    dot = file_name.rpartition(".")
    word = dot[2].lower()
    return f".{word}" if dot[1] and word.isascii() and word.isalnum() and len(word) <= 8 else ""
