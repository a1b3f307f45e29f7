"""The form of the original RAPP platform and of its clients of 2014 to 2017, with their habits.

Arguments are one JSON object in a form field `json`, files are parts of multipart. Its clients also send: no Content-Type;
`json=` and then JSON that is not percent-encoded; bare JSON as a form; a path with a slash at its end; GET; multipart with
lone LFs and without end; loose fields, a `user`, an empty text for an empty list. Every answer is an object with `error`,
empty when all is well, and with status 200 unless the token is wrong or the platform fails.
"""

from collections.abc import Mapping
from typing import Any
from urllib.parse import parse_qsl, unquote_plus

from rapp_hop import strict_json
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_hop.multipart import parse_multipart, parse_options
from rapp_hop.own_form import JSON, result_json
from rapp_hop.parameters import accepts, texts_to_values
from rapp_hop.protocol import MAX_JSON, Call, Upload, WireAnswer, WireRequest, suffix_of
from rapp_hop.service import Service

_TEXT = "text/plain; charset=utf-8"
_FIELDS = 64  # of a form without files


class OriginalForm:
    """See `protocol.Form`."""

    def read(self, request: WireRequest, service: Service) -> Call:
        """Return the call; arguments that the service does not know are left out, as the original platform did."""
        kind, options = parse_options(request.headers.get("content-type", ""))
        uploads: tuple[Upload, ...] = ()
        if kind == "multipart/form-data" and request.method == "POST":
            given, texts, uploads = _from_parts(request, options.get("boundary", ""))
        else:
            given, texts = _from_text(request)
        given = {**texts_to_values({name: text for name, text in texts.items() if name not in given}, service.known), **given}
        return Call({name: _fit(value, service, name) for name, value in given.items() if name in service.known}, uploads)

    def write(self, result: Any, service: Service) -> WireAnswer:
        """Return the result with an empty `error`; what is no object comes as `result`."""
        found = result if isinstance(result, dict) else {"result": result}
        return WireAnswer(200, JSON, result_json({"error": "", **found}, service))

    def write_error(self, error: HopError, service: Service | None) -> WireAnswer:
        """Return the platform's own three failures as its text pages, all else as `error` beside the blank result."""
        if error.status == 401:
            return WireAnswer(401, _TEXT, b"Authentication Failure")
        if error.status == 404 and service is None:
            return WireAnswer(404, _TEXT, b"This service is unknown!")
        if isinstance(error, Bug | Unreachable) or service is None:
            status = 500 if isinstance(error, Bug | Unreachable) else error.status or 400
            return WireAnswer(status, _TEXT, b"Server Error" if status == 500 else str(error).encode())
        body = {**service.blank, "error": str(error)}
        return WireAnswer(200, JSON, strict_json.dumps(body).encode())


def _from_parts(request: WireRequest, boundary: str) -> tuple[dict[str, Any], dict[str, Any], tuple[Upload, ...]]:
    given: dict[str, Any] = {}
    texts: dict[str, Any] = {}
    uploads: list[Upload] = []
    for part in parse_multipart(request.body, boundary, tolerant=True):
        if part.file_name is not None:
            uploads.append(Upload(part.name, part.data, suffix_of(part.file_name)))
        elif part.name == "json":
            given = _json(part.value)
        else:
            texts[part.name] = _text(part.value)
    names = [upload.parameter for upload in uploads]
    if len(set(names)) != len(names) or set(names) & set(given):
        raise Invalid("cannot read the call: a parameter is given twice")
    return given, texts, tuple(uploads)


def _from_text(request: WireRequest) -> tuple[dict[str, Any], dict[str, Any]]:
    if len(request.body) > MAX_JSON:
        raise Refused(f"cannot read a form of {len(request.body)} bytes: at most {MAX_JSON} are allowed", 413)
    body = _text(bytes(request.body)).strip()
    if request.method == "GET" and not body:
        body = request.query
    raw = body.removeprefix("json=").lstrip()
    if raw.startswith("{"):
        return _json(raw.encode()), {}
    try:
        fields = dict(parse_qsl(body, keep_blank_values=True, max_num_fields=_FIELDS, errors="strict"))
    except ValueError:
        raise Invalid("cannot read the form: it is not UTF-8, or has too many fields") from None
    return _json(fields.pop("json", "").encode()), dict(fields)


def _json(data: bytes) -> dict[str, Any]:
    if not data.strip():
        return {}
    try:
        found = strict_json.loads(data, limit=MAX_JSON)
    except Invalid:
        found = strict_json.loads(unquote_plus(data.decode("utf-8", "replace")), limit=MAX_JSON)
    if not isinstance(found, dict):
        raise Invalid("cannot read the field json: it must hold an object")
    return found


def _text(data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise Invalid("cannot read the form: it is not UTF-8") from None


def _fit(value: Any, service: Service, name: str) -> Any:
    hint = service.known[name].hint
    return [] if value == "" and accepts(hint, list) and not accepts(hint, str) else value


def is_original(headers: Mapping[str, str]) -> bool:
    """Tell whether a client names itself as one of the originals."""
    return headers.get("user-agent", "").startswith(("rapp_api/", "rapp-platform-api/"))
