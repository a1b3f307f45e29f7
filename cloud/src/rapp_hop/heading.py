"""A request's head from what the parser found, by rules stricter than HTTP's where HTTP leaves a choice. Pure."""

from collections.abc import Sequence

from rapp_hop.errors import HopError, Invalid, Refused
from rapp_hop.heads import Head

MAX_FIELDS = 100  # header lines
_ONCE = frozenset({"host", "accept-token", "authorization", "content-type", "origin", "idempotency-key"})


def make_head(method: str, version: str, url: bytes, fields: Sequence[tuple[bytes, bytes]], address: str, limit: int) -> Head:
    """Return the head.

    :param limit: bytes of target and header lines
    :raises Refused: when it is too long
    :raises Invalid: when it could be understood in two ways
    """
    if version not in ("1.0", "1.1"):
        raise Invalid("cannot serve this version: speak HTTP/1.1")
    if len(fields) > MAX_FIELDS:
        raise Refused(f"cannot take more than {MAX_FIELDS} header lines", 431)
    headers: dict[str, str] = {}
    size = len(url)
    for raw_name, raw_value in fields:
        size += len(raw_name) + len(raw_value) + 4
        name, value = raw_name.decode("ascii").lower(), raw_value.decode("latin-1").strip()
        if name in headers:
            if name in _ONCE:
                raise Invalid(f"cannot read the request: the header {name} stands twice")
            value = f"{headers[name]}, {value}"
        headers[name] = value
    if size > limit:
        raise long_head(limit)
    if version == "1.1" and "host" not in headers:
        raise Invalid("cannot read the request: it has no header Host")
    if headers.get("transfer-encoding", "chunked").lower() != "chunked":
        raise Invalid("cannot read the request: of transfer encodings only chunked is spoken")
    path, _, query = url.decode("ascii").partition("?")
    return Head(method, path, query, headers, address)


def long_head(limit: int) -> HopError:
    """Return the error for headers that are too long."""
    return Refused(f"cannot take more than {limit} bytes of headers", 431)
