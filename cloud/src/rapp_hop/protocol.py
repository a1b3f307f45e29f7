"""HOP's requests and answers as values. Pure: bytes in, dataclasses out, and back.

A *form* is one way to write a call on the wire. The forms are tried in the order of `FORMS`; each says whether a request
is written in it, reads it, and writes the answer. This module has our own JSON form (DESIGN §3.3); the form of the
original RAPP platform and that of Hop.js clients are to be further entries of the same tuple.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from rapp_hop import strict_json
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_hop.multipart import parse_multipart, parse_options

MAX_JSON = 4 * 2**20  # bytes of arguments
STATUS: dict[str, int] = {Refused.kind: 403, Unreachable.kind: 503, Invalid.kind: 400, Bug.kind: 500}
STATUSES = frozenset({400, 401, 403, 404, 405, 408, 413, 500, 503})


@dataclass(frozen=True)
class WireRequest:
    """An HTTP request as it came, its body whole."""

    method: str
    path: str
    headers: Mapping[str, str]  # names in lower case
    body: bytes


@dataclass(frozen=True)
class WireAnswer:
    """An HTTP answer to send."""

    status: int
    content_type: str
    body: bytes


@dataclass(frozen=True)
class Upload:
    """A file that came with a call, not yet on the disk."""

    parameter: str
    data: bytes
    suffix: str  # of the sender's file name, such as .ogg; nothing else of that name is kept


@dataclass(frozen=True)
class Call:
    """A service and its named arguments."""

    service: str
    arguments: Mapping[str, Any]
    uploads: tuple[Upload, ...] = ()


class Form(Protocol):
    """One way to write calls."""

    def speaks(self, request: WireRequest) -> bool:
        """Tell whether the request is written in this form."""

    def read(self, request: WireRequest, service: str) -> Call:
        """Return the call.

        :raises Invalid: when the request is broken
        """

    def write(self, result: Any) -> WireAnswer:
        """Return the answer for a result."""

    def write_error(self, error: HopError) -> WireAnswer:
        """Return the answer for an error."""


class JsonForm:
    """Our own form: POST, a JSON object of named parameters, or multipart with it in the field `json` and files."""

    def speaks(self, request: WireRequest) -> bool:
        """Take every POST of JSON or multipart."""
        kind = parse_options(request.headers.get("content-type", ""))[0]
        return request.method == "POST" and kind in ("application/json", "multipart/form-data")

    def read(self, request: WireRequest, service: str) -> Call:
        """Return the call; see `Form.read`."""
        kind, options = parse_options(request.headers["content-type"])
        if options.get("charset", "utf-8").lower() not in ("utf-8", "utf8"):
            raise Invalid("cannot read the call: send it as UTF-8")
        if kind == "application/json":
            return Call(service, _arguments(request.body))
        arguments: Mapping[str, Any] = {}
        uploads: list[Upload] = []
        for part in parse_multipart(request.body, options.get("boundary", "")):
            if part.file_name is not None:
                uploads.append(Upload(part.name, part.data, _suffix(part.file_name)))
            elif part.name == "json":
                arguments = _arguments(part.data)
            else:
                raise Invalid(f"cannot read the field {part.name[:40]!r}: arguments go into the field json")
        names = [*arguments, *(upload.parameter for upload in uploads)]
        if len(set(names)) != len(names):
            raise Invalid("cannot read the call: a parameter is given twice")
        return Call(service, arguments, tuple(uploads))

    def write(self, result: Any) -> WireAnswer:
        """Return the bare result as JSON."""
        return WireAnswer(200, "application/json", strict_json.dumps(result).encode())

    def write_error(self, error: HopError) -> WireAnswer:
        """Return kind and message as JSON, with the status of the kind unless the error brings a better one."""
        status = error.status if error.status in STATUSES else STATUS[error.kind]
        body = {"error": {"kind": error.kind, "message": str(error)}}
        return WireAnswer(status, "application/json", strict_json.dumps(body).encode())


JSON_FORM = JsonForm()
FORMS: tuple[Form, ...] = (JSON_FORM,)


def form_of(request: WireRequest) -> Form:
    """Return the form a request is written in.

    :raises Invalid: when there is none
    """
    for form in FORMS:
        if form.speaks(request):
            return form
    raise Invalid("cannot read the call: POST application/json or multipart/form-data")


def _arguments(data: bytes) -> Mapping[str, Any]:
    found = strict_json.loads(data, limit=MAX_JSON) if data else {}
    if not isinstance(found, dict):
        raise Invalid("cannot read the call: its arguments must be a JSON object")
    return found


def _suffix(file_name: str) -> str:
    dot = file_name.rpartition(".")
    word = dot[2].lower()
    return f".{word}" if dot[1] and word.isascii() and word.isalnum() and len(word) <= 8 else ""
