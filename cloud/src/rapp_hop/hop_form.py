"""The form of real Hop clients: GET and PUT with the arguments in the query, POST with positional parts, node's headers.

Generations and their marks are those of Hop 2.5 to 3.7. Positional arguments go to the parameters in their order; one
object alone, as Hop's services with named arguments get it, names them. Text is answered as text, all else as JSON, which
every Hop client decodes by the content type, and node's by the header `hop-serialize`.
"""

from collections.abc import Mapping
from typing import Any
from urllib.parse import parse_qsl, quote_from_bytes, unquote, unquote_to_bytes

from rapp_hop import bigloo, hopjs, strict_json
from rapp_hop.bigloo import UNDEFINED
from rapp_hop.errors import HopError, Invalid
from rapp_hop.multipart import Part, parse_multipart, parse_options
from rapp_hop.own_form import JSON, OwnForm, result_json
from rapp_hop.parameters import accepts, texts_to_values
from rapp_hop.protocol import MAX_JSON, Call, Upload, WireAnswer, WireRequest, suffix_of
from rapp_hop.service import Service

_FIELDS = 64
_OWN = OwnForm()
_MARKS = frozenset({"hop-serialize", "hop-client", "hop-responsetype", "hopjs-arguments", "hop-arguments"})


class HopForm:
    """See `protocol.Form`."""

    def read(self, request: WireRequest, service: Service) -> Call:
        """Return the call."""
        kind, options = parse_options(request.headers.get("content-type", ""))
        if request.method == "POST" and request.body:
            if kind == "multipart/form-data":
                return _from_parts(parse_multipart(request.body, options.get("boundary", ""), tolerant=True), service)
            if kind == JSON:
                return _from_json(_bounded(request), service)
            if kind == "application/x-www-form-urlencoded":
                return _named_texts(_fields(_bounded(request)), service)
            raise Invalid("cannot read the call: send multipart/form-data, JSON or a form")
        return _from_query(request, service)

    def write(self, result: Any, service: Service) -> WireAnswer:
        """Return text as text, all else as JSON."""
        if isinstance(result, str):
            return WireAnswer(200, "text/plain; charset=UTF-8", _encode(result, service), (("Hop-Serialize", "string"),))
        return WireAnswer(200, JSON, result_json(result, service), (("Hop-Serialize", _mark(result)),))

    def write_error(self, error: HopError, service: Service | None) -> WireAnswer:
        """Return kind and message; a client gets the message of our own fault as the error's value by `Hop-Error`."""
        answer = _OWN.write_error(error, service)
        more: tuple[tuple[str, str], ...] = ()
        if answer.status == 401:
            more = (("WWW-Authenticate", 'Basic realm="hop"'),)
        elif answer.status == 500:
            more = (("Hop-Error", quote_from_bytes(bigloo.dumps(str(error)))),)
        return WireAnswer(answer.status, answer.content_type, answer.body, answer.headers + more)


def is_hop(headers: Mapping[str, str], query: str) -> bool:
    """Tell whether a request bears the marks of a Hop client."""
    return not _MARKS.isdisjoint(headers) or "hop-encoding=" in query or "hop-serialize=" in query


def _from_query(request: WireRequest, service: Service) -> Call:
    headers = request.headers
    if "hopjs-arguments" in headers:
        return _from_values(_raw_fields(headers["hopjs-arguments"]), service)
    if "hop-arguments" in headers:
        return _positional(_array(unquote(headers["hop-arguments"])), service)
    fields = _raw_fields(request.query)
    if "hop-encoding" in fields or "hop-serialize" in fields:
        return _from_values(fields, service)
    return _named_texts(_fields(request.query), service)


def _from_values(fields: Mapping[str, str], service: Service) -> Call:
    if fields.get("hop-serialize") == "json-url":
        return _positional(_array(unquote(fields.get("hop-arguments", "[]"))), service)
    values = fields.get("vals", "")
    match fields.get("hop-encoding"):
        case "hop":
            found = bigloo.loads(unquote_to_bytes(values))
            return _positional(found if isinstance(found, list) else [] if found is None else [found], service)
        case "hopjs":
            return _positional(hopjs.loads(unquote(values)), service)
        case "json":
            found = strict_json.loads(unquote(values), limit=MAX_JSON)
            return _positional(list(found.values()) if isinstance(found, dict) else _as_list(found), service)
    raise Invalid("cannot read the call: its hop-encoding is none of hop, hopjs, json")


def _from_parts(parts: list[Part], service: Service) -> Call:
    if not any(part.encoding for part in parts):
        texts: dict[str, Any] = {}
        uploads = tuple(Upload(part.name, part.data, suffix_of(part.file_name)) for part in parts if part.file_name is not None)
        for part in parts:
            if part.file_name is None:
                _put(texts, part.name, part.value)
        call = _named_texts(texts, service)
        return Call(call.arguments, uploads)
    if not all(part.encoding for part in parts):
        raise Invalid("cannot read the call: some parts have a hop-encoding and some have none")
    return _positional([_part_value(part) for part in parts], service)


def _part_value(part: Part) -> Any:
    match part.encoding:
        case "string" | "keyword":
            return _text(part.value)
        case "integer":
            text = _text(part.value).strip()
            if not text.removeprefix("-").isdecimal() or len(text) > 40:
                raise Invalid(f"cannot read the call: {text[:40]!r} is no whole number")
            return int(text)
        case "hop":
            return bigloo.loads(part.value)
    raise Invalid(f"cannot read the call: unknown hop-encoding {part.encoding[:40]!r}")


def _from_json(data: bytes, service: Service) -> Call:
    found = strict_json.loads(data, limit=MAX_JSON)
    return Call(found) if isinstance(found, dict) else _positional(_as_list(found), service)


def _positional(values: list[Any], service: Service) -> Call:
    parameters = service.parameters
    if len(values) == 1 and isinstance(values[0], dict) and not (parameters and accepts(parameters[0].hint, dict)):
        return Call(values[0])
    if len(values) > len(parameters):
        raise Invalid(f"cannot call {service.name}: it takes at most {len(parameters)} arguments")
    arguments: dict[str, Any] = {}
    uploads: list[Upload] = []
    for parameter, value in zip(parameters, values, strict=False):
        if value is UNDEFINED:
            continue
        if isinstance(value, bytes) and parameter.takes_file:
            uploads.append(Upload(parameter.name, value, ""))
        else:
            arguments[parameter.name] = _plain(value)
    return Call(arguments, tuple(uploads))


def _named_texts(texts: Mapping[str, Any], service: Service) -> Call:
    return Call(texts_to_values(texts, service.known))


def _plain(value: Any) -> Any:
    if value is UNDEFINED:
        return None
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    return value


def _raw_fields(text: str) -> dict[str, str]:
    return {name: value for name, _, value in (field.partition("=") for field in text.split("&")[:_FIELDS])}


def _fields(text: bytes | str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    try:
        words = text if isinstance(text, str) else text.decode("utf-8")
        for name, value in parse_qsl(words, keep_blank_values=True, max_num_fields=_FIELDS, errors="strict"):
            _put(found, name, value)
    except ValueError:
        raise Invalid("cannot read the form: it is not UTF-8, or has too many fields") from None
    return found


def _put(found: dict[str, Any], name: str, value: str | bytes) -> None:
    text = value if isinstance(value, str) else _text(value)
    if name not in found:
        found[name] = text
    elif isinstance(found[name], list):
        found[name].append(text)
    else:
        found[name] = [found[name], text]


def _bounded(request: WireRequest) -> bytes:
    if len(request.body) > MAX_JSON:
        raise Invalid(f"cannot read a call of {len(request.body)} bytes: at most {MAX_JSON} are allowed")
    return bytes(request.body)


def _array(text: str) -> list[Any]:
    return _as_list(strict_json.loads(text, limit=MAX_JSON))


def _as_list(value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise Invalid("cannot read the call: its arguments must be a list")
    return value


def _text(data: bytes) -> str:
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise Invalid("cannot read the call: a text is not UTF-8") from None


def _encode(text: str, service: Service) -> bytes:
    try:
        return text.encode()
    except UnicodeEncodeError:
        return result_json(text, service)


def _mark(result: Any) -> str:
    if result is None or isinstance(result, bool):
        return {None: "null", True: "true", False: "false"}[result]
    return "number" if isinstance(result, int | float) else "json"
