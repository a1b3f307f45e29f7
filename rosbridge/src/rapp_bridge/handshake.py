"""The HTTP request that opens a WebSocket (RFC 6455, section 4), pure: who may come in, and what is answered."""

import base64
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from urllib.parse import urlsplit

_GUID = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
LIMIT = 16 << 10  # bytes of the request's head
END = b"\r\n\r\n"


class TurnedAwayError(Exception):
    """The request is not let in; `response` is what is sent before the connection is closed."""

    def __init__(self, status: str, text: str) -> None:
        super().__init__(text)
        body = text.encode() + b"\n"
        head = f"HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {len(body)}\r\n"
        self.response = head.encode() + b"Sec-WebSocket-Version: 13\r\nConnection: close\r\n\r\n" + body


@dataclass(frozen=True)
class Accepted:
    """The answer to a good request, and the token it brought in its Authorization header, if any."""

    response: bytes
    token: str | None


def answer(head: bytes, origins: Sequence[str]) -> Accepted:
    """Check a request's head, given without its blank line; `origins`: pages that may connect beside those of this machine.

    Any path is accepted, as upstream does. Raises TurnedAwayError.
    """
    fields = _fields(head)
    key = fields.get("sec-websocket-key", "")
    if fields.get("upgrade", "").lower() != "websocket" or "upgrade" not in fields.get("connection", "").lower():
        raise TurnedAwayError("426 Upgrade Required", "cannot serve plain HTTP; this is a rosbridge WebSocket")
    if fields.get("sec-websocket-version") != "13" or not _is_key(key):
        raise TurnedAwayError("400 Bad Request", "cannot open the WebSocket: version 13 and a key of 16 bytes are needed")
    origin = fields.get("origin")
    if origin is not None and not _is_welcome(origin, fields.get("host", ""), origins):
        raise TurnedAwayError(
            "403 Forbidden", f"cannot serve pages of {origin[:200]}; start the bridge with --origin to let them in"
        )
    accept = base64.b64encode(hashlib.sha1(key.encode() + _GUID).digest())
    response = b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: "
    scheme, _, token = fields.get("authorization", "").partition(" ")
    return Accepted(response + accept + b"\r\n\r\n", token.strip() if scheme.lower() == "bearer" else None)


def _fields(head: bytes) -> dict[str, str]:
    first, *lines = head.decode("latin-1").split("\r\n")
    words = first.split(" ")
    if len(words) != 3 or words[0] != "GET" or not words[2].startswith("HTTP/1.1"):
        raise TurnedAwayError("400 Bad Request", "cannot read the request: GET and HTTP/1.1 are needed")
    fields: dict[str, str] = {}
    for line in lines:
        name, colon, value = line.partition(":")
        name = name.lower()
        if not colon or not name or name != name.strip() or (name in fields and name in ("host", "origin", "sec-websocket-key")):
            raise TurnedAwayError("400 Bad Request", "cannot read the request's header lines")
        fields[name] = value.strip()
    return fields


def _is_key(key: str) -> bool:
    try:
        return len(base64.b64decode(key, validate=True)) == 16
    except ValueError:
        return False


def _is_welcome(origin: str, host: str, origins: Sequence[str]) -> bool:
    """Pages of this machine and pages from the bridge's own address are; so nobody's page in a browser reaches the robot."""
    if "*" in origins or origin in origins or _host(origin) == "localhost":
        return True
    try:
        page = ip_address(_host(origin))
        return page.is_loopback or page == ip_address(_host("//" + host))
    except ValueError:  # a name can be pointed at this machine by anybody, so only addresses count as the bridge's own
        return False


def _host(url: str) -> str:
    try:
        return urlsplit(url).hostname or ""
    except ValueError:
        return ""
