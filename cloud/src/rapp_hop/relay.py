"""Passes a request on, as it came, to a HOP server on a UNIX socket, and its answer back: whichever form it is written in."""

from pathlib import Path

from tornado.httpclient import HTTPClientError, HTTPRequest, HTTPResponse

from rapp_hop.client import MAX_ANSWER, OVERRUN
from rapp_hop.connecting import make_connections
from rapp_hop.errors import Unreachable
from rapp_hop.protocol import WireAnswer, WireRequest
from rapp_hop.streaming import Sink

_OWN = frozenset({
    "host", "connection", "keep-alive", "te", "trailer", "transfer-encoding", "upgrade", "content-length", "expect",
    "accept-encoding", "accept-token", "authorization", "cookie", "origin", "proxy-authorization",
})  # fmt: skip
_KEPT = ("Hop-Serialize", "Hop-Error", "Content-Disposition", "Retry-After", "WWW-Authenticate")


async def relay(socket_path: Path, request: WireRequest, path: str, timeout: float, token: str | None = None) -> WireAnswer:
    """Send the request to `path` over the socket and return the answer; no credentials of the caller go along.

    :param timeout: seconds
    :param token: sent as `Accept-Token` instead of the caller's
    :raises Unreachable: when nobody serves there, or not in time
    :raises Invalid: when the answer is longer than `MAX_ANSWER`, as it is held whole
    """
    headers = {name: value for name, value in request.headers.items() if name not in _OWN}
    if token is not None:
        headers["Accept-Token"] = token
    url = f"http://agent{path}" + (f"?{request.query}" if request.query else "")
    pieces: list[bytes] = []
    sink = Sink(f"the answer of {path}", pieces.append, MAX_ANSWER, None)
    outgoing = HTTPRequest(
        url, request.method, headers, bytes(request.body) if request.method in ("POST", "PUT") else None,
        request_timeout=timeout, connect_timeout=min(timeout, 5.0), follow_redirects=False, decompress_response=False,
        allow_nonstandard_methods=True, header_callback=sink.header, streaming_callback=sink.data,
    )  # fmt: skip
    client = make_connections(socket_path, max_clients=1, max_body_size=MAX_ANSWER + OVERRUN)
    try:
        answer = await client.fetch(outgoing, raise_error=False)
    except (OSError, HTTPClientError, ValueError) as error:
        sink.check()
        raise Unreachable(f"cannot reach the agent: {error}, try again later", 503) from None
    finally:
        client.close()
    sink.check()
    return _answer(answer, b"".join(pieces) or sink.refusal)


def _answer(answer: HTTPResponse, body: bytes) -> WireAnswer:
    kept = tuple((name, answer.headers[name]) for name in _KEPT if name in answer.headers)
    kind = answer.headers.get("Content-Type", "application/octet-stream")
    return WireAnswer(answer.code, kind, body, kept)
