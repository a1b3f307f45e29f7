"""A request's head from what Tornado parsed, by rules stricter than HTTP's where HTTP leaves a choice. Pure."""

from tornado.httputil import HTTPHeaders

from rapp_hop.errors import HopError, Invalid, Refused
from rapp_hop.heads import Head

MAX_FIELDS = 100  # header lines
_ONCE = frozenset({
    "host", "accept-token", "authorization", "content-type", "content-length", "transfer-encoding", "origin",
    "idempotency-key",
})  # fmt: skip


def make_head(method: str, version: str, target: str, fields: HTTPHeaders, address: str, limit: int) -> Head:
    """Return the head.

    :param limit: bytes of target and header lines
    :raises Refused: when it is too long
    :raises Invalid: when it could be understood in two ways
    """
    if version not in ("1.0", "1.1"):
        raise Invalid("cannot serve this version: speak HTTP/1.1")
    headers: dict[str, str] = {}
    size, count = len(target), 0
    for raw_name, value in fields.get_all():
        count += 1
        size += len(raw_name) + len(value) + 4
        name = raw_name.lower()
        if name in headers:
            if name in _ONCE:
                raise Invalid(f"cannot read the request: the header {name} stands twice")
            value = f"{headers[name]}, {value}"
        headers[name] = value
    if count > MAX_FIELDS:
        raise Refused(f"cannot take more than {MAX_FIELDS} header lines", 431)
    if size > limit:
        raise long_head(limit)
    if version == "1.1" and "host" not in headers:
        raise Invalid("cannot read the request: it has no header Host")
    length = headers.get("content-length", "0")
    if not (length.isascii() and length.isdecimal()):
        raise Invalid("cannot read the request: its Content-Length is no number")
    path, _, query = target.partition("?")
    if not path.startswith("/") or not target.isascii():
        raise Invalid("cannot read the request: its target is no path")
    return Head(method, path, query, headers, address)


def long_head(limit: int) -> HopError:
    """Return the error for headers that are too long."""
    return Refused(f"cannot take more than {limit} bytes of headers", 431)
