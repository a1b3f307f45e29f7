"""Our own form: POST, a JSON object of named parameters, or multipart with it in the field `json` and files (DESIGN §3.3)."""

from collections.abc import Mapping
from typing import Any

from rapp_hop import strict_json
from rapp_hop.errors import Bug, HopError, Invalid
from rapp_hop.multipart import parse_multipart, parse_options
from rapp_hop.protocol import MAX_JSON, Body, Call, Upload, WireAnswer, WireRequest, headers_of, status_of, suffix_of
from rapp_hop.service import Service

JSON = "application/json"


class OwnForm:
    """See `protocol.Form`; the bare result as JSON, errors as kind and message."""

    def read(self, request: WireRequest, service: Service) -> Call:
        """Return the call; see `protocol.Form`."""
        content_type = request.headers.get("content-type", "")
        if content_type == JSON:
            return Call(_arguments(request.body))
        kind, options = parse_options(content_type)
        if options.get("charset", "utf-8").lower() not in ("utf-8", "utf8"):
            raise Invalid("cannot read the call: send it as UTF-8")
        if kind == JSON:
            return Call(_arguments(request.body))
        return _from_parts(request.body, options.get("boundary", ""))

    def write(self, result: Any, service: Service) -> WireAnswer:
        """Return the bare result as JSON."""
        return WireAnswer(200, JSON, result_json(result, service))

    def write_error(self, error: HopError, service: Service | None) -> WireAnswer:
        """Return kind and message as JSON."""
        body = {"error": {"kind": error.kind, "message": str(error)}}
        return WireAnswer(status_of(error), JSON, strict_json.dumps(body).encode(), headers_of(error))


def result_json(result: Any, service: Service) -> bytes:
    """Return a result as JSON.

    :raises Bug: when JSON cannot hold it
    """
    try:
        return strict_json.dumps(result).encode()
    except (Invalid, UnicodeEncodeError) as error:
        raise Bug(f"cannot answer for {service.name}: its result is not JSON ({error})") from None


def _from_parts(body: Body, boundary: str) -> Call:
    arguments: Mapping[str, Any] = {}
    uploads: list[Upload] = []
    for part in parse_multipart(body, boundary):
        if part.file_name is not None:
            uploads.append(Upload(part.name, part.data, suffix_of(part.file_name)))
        elif part.name == "json":
            arguments = _arguments(part.value)
        else:
            raise Invalid(f"cannot read the field {part.name[:40]!r}: arguments go into the field json")
    names = [*arguments, *(upload.parameter for upload in uploads)]
    if len(set(names)) != len(names):
        raise Invalid("cannot read the call: a parameter is given twice")
    return Call(arguments, tuple(uploads))


def _arguments(data: Body) -> Mapping[str, Any]:
    if len(data) > MAX_JSON:
        raise Invalid(f"cannot read JSON of {len(data)} bytes: at most {MAX_JSON} are allowed")
    found = strict_json.loads(bytes(data), limit=MAX_JSON) if data else {}
    if not isinstance(found, dict):
        raise Invalid("cannot read the call: its arguments must be a JSON object")
    return found
