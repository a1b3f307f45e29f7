"""Tornado's HTTP client for HOP: over TCP or one UNIX socket, its errors translated once into ours."""

import asyncio
import errno
import math
import socket
import ssl
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from tornado.httpclient import HTTPClientError, HTTPRequest, HTTPResponse
from tornado.iostream import IOStream, UnsatisfiableReadError
from tornado.netutil import DefaultLoopResolver
from tornado.simple_httpclient import HTTPStreamClosedError, HTTPTimeoutError, SimpleAsyncHTTPClient
from tornado.tcpclient import TCPClient

from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable

MAX_TIMEOUT = 24 * 3600.0  # seconds
NAME_TIMEOUT = 4.0  # seconds to find an address; shorter than the time to connect, after which Tornado would log what comes late
NOT_SENT = "not sent"
"""`HopError.reason` of a call of which nothing was sent."""
CUT = "cut"
"""`HopError.reason` of a call that may have run, or not."""

BY_STATUS: dict[int, type[HopError]] = {
    400: Invalid, 401: Refused, 403: Refused, 404: Refused, 408: Unreachable, 413: Refused, 429: Unreachable,
    500: Bug, 502: Unreachable, 503: Unreachable, 504: Unreachable,
}  # fmt: skip
_DISTRUST = {
    9: "its certificate is not good yet; set this computer's clock, or wait",
    10: "its certificate has expired; who runs it must renew it (or this computer's clock is wrong)",
    **dict.fromkeys(
        (18, 19, 20, 21),
        "nobody whom this computer trusts vouches for its certificate; name the file of who does (RAPP_CLOUD_CA_FILE)",
    ),
    **dict.fromkeys((62, 64), "its certificate is for another name; call it by that, or have the certificate made for this one"),
}
"""By OpenSSL's X509_V_ERR_…"""
_NOBODY = frozenset({errno.ECONNREFUSED, errno.ENOENT, errno.EHOSTUNREACH, errno.ENETUNREACH, errno.EHOSTDOWN})


def make_connections(socket_path: Path | None, **bounds: int) -> SimpleAsyncHTTPClient:
    """Return a client of its own; every connection goes to one UNIX socket, where a path is given."""
    client = SimpleAsyncHTTPClient(force_instance=True, resolver=_Resolver(), **bounds)
    if socket_path is not None:
        client.tcp_client.close()
        client.tcp_client = _SocketClient(socket_path)
    return client


async def fetch(client: SimpleAsyncHTTPClient, request: HTTPRequest, timeout: float, connect_timeout: float) -> HTTPResponse:
    """Send a request and return the answer, of whatever status; redirects are not followed.

    :param timeout: seconds for the whole
    :raises Unreachable: `reason` tells whether anything was sent
    :raises Invalid: what came is no HTTP, or the time-out is none
    """
    if not (math.isfinite(timeout) and 0 < timeout <= MAX_TIMEOUT):
        raise Invalid(f"cannot call within {timeout} s: give a time above zero, at most {MAX_TIMEOUT:g} s")
    request.request_timeout = timeout
    request.connect_timeout = min(connect_timeout, timeout)
    request.follow_redirects = False
    where = request.url.partition("?")[0]
    try:
        return await client.fetch(request, raise_error=False)
    except HTTPTimeoutError as error:
        sent = "connecting" not in str(error) and "queue" not in str(error)
        raise _away(f"cannot reach {where} within {timeout:g} s: try again later", CUT if sent else NOT_SENT) from None
    except HTTPStreamClosedError:
        raise _away(f"cannot read the answer of {where}: the connection was cut, try again", CUT) from None
    except ssl.SSLCertVerificationError as error:
        raise _away(f"cannot trust {where}: {_DISTRUST.get(error.verify_code, error.verify_message)}", NOT_SENT) from None
    except (OSError, HTTPClientError) as error:
        sent = not isinstance(error, socket.gaierror) and getattr(error, "errno", None) not in _NOBODY
        raise _away(f"cannot reach {where}: {error}, try again later", CUT if sent else NOT_SENT) from None
    except UnsatisfiableReadError:
        raise Invalid(f"cannot read the answer of {where}: its headers have no end") from None
    except ValueError as error:
        raise Invalid(f"cannot call {where}: {error}") from None


def origin(url: str) -> tuple[str, str | None, int]:
    """Return scheme, host and port of a URL."""
    parts = urlsplit(url)
    return parts.scheme, parts.hostname, parts.port or (443 if parts.scheme == "https" else 80)


def _away(message: str, reason: str) -> Unreachable:
    error = Unreachable(message)
    error.reason = reason
    return error


class _Resolver(DefaultLoopResolver):
    """Finds addresses within a bound; the system's own waits for a name server that is away as long as it likes."""

    async def resolve(self, host: str, port: int, family: socket.AddressFamily = socket.AF_UNSPEC) -> list[tuple[int, Any]]:
        """Return (family, address) pairs. Raises gaierror."""
        try:
            return await asyncio.wait_for(super().resolve(host, port, family), NAME_TIMEOUT)
        except TimeoutError:
            raise socket.gaierror(socket.EAI_AGAIN, "no name server answers") from None


class _SocketClient(TCPClient):
    """Opens connections to one UNIX socket, whatever host is asked for."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path

    async def connect(self, host: str, port: int, *_: Any, max_buffer_size: int | None = None, **__: Any) -> IOStream:
        """Return a connection to the socket."""
        line = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        stream = IOStream(line, max_buffer_size=max_buffer_size)
        await stream.connect(str(self._path))
        return stream
