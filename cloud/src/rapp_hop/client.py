"""The calling half of HOP: `await client.call(...)`, callbacks with `with_url`, and bounded streaming downloads.

Own JSON form of the contract: `POST /hop/<name>`, named parameters in, bare result out; with files multipart, the
arguments in the field `json`. Redirects are never followed: they would carry the token to a foreign host.
"""

import asyncio
import logging
import math
import secrets
import socket
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

from tornado.httpclient import HTTPClientError, HTTPRequest, HTTPResponse
from tornado.iostream import IOStream, UnsatisfiableReadError
from tornado.simple_httpclient import HTTPStreamClosedError, HTTPTimeoutError, SimpleAsyncHTTPClient
from tornado.tcpclient import TCPClient

from rapp_hop import strict_json
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable, from_wire
from rapp_hop.streaming import Progress, Sink, Writer

MAX_ANSWER = 16 * 2**20  # bytes of one JSON answer
MAX_UPLOAD = 64 * 2**20  # bytes of one request with its files
OVERRUN = 2**20  # bytes of a download beyond its limit before the connection is cut
IDLE = 10.0  # seconds in which nothing comes of a download before it is given up
CLIENTS = 64  # calls of one client on the wire at once; more wait, so that one slow call does not hold up the next

_log = logging.getLogger(__name__)
_BY_STATUS: dict[int, type[HopError]] = {
    400: Invalid, 401: Refused, 403: Refused, 404: Refused, 408: Unreachable, 413: Refused, 429: Unreachable,
    500: Bug, 502: Unreachable, 503: Unreachable, 504: Unreachable,
}  # fmt: skip


class HopClient:
    """A caller of one platform's services; use it inside a running asyncio loop and `close()` it at the end."""

    def __init__(
        self, base_url: str, token: str | None = None, connect_timeout: float = 5.0, socket_path: Path | None = None
    ) -> None:
        """Remember where to call; opens nothing yet.

        :param base_url: such as http://127.0.0.1:9001
        :param socket_path: of a UNIX socket on which the platform serves; the URL then only fills the header `Host`
        :param token: sent as `Accept-Token` to that platform only
        :param connect_timeout: seconds
        :raises Invalid: when the URL is not an http(s) URL
        """
        self.base_url = base_url.rstrip("/")
        if urlsplit(self.base_url).scheme not in ("http", "https") or not urlsplit(self.base_url).hostname:
            raise Invalid(f"cannot call {base_url!r}: give a URL such as http://127.0.0.1:9001")
        self._token = token
        self._connect_timeout = connect_timeout
        self._socket_path = socket_path
        self._client: SimpleAsyncHTTPClient | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def call(
        self,
        service: str,
        args: Mapping[str, Any] | None = None,
        files: Mapping[str, Path] | None = None,
        timeout: float = 30.0,
    ) -> Any:
        """Call `/hop/<service>` and return its result.

        :param files: files to upload, by parameter name
        :param timeout: seconds for the whole call
        :raises HopError: a leaf by what to do next
        """
        return await self._call(f"{self.base_url}/hop/{quote(service)}", args or {}, files or {}, timeout)

    def with_url(
        self,
        url: str,
        args: Mapping[str, Any],
        on_result: Callable[[Any], None],
        on_error: Callable[[HopError], None],
        timeout: float = 30.0,
    ) -> asyncio.Task[None]:
        """Call `url` in the background (deliverable §4.4 `withURL`); exactly one callback runs later on this loop.

        :param url: a whole URL, or a path on this client's platform; the token goes to this platform only
        :return: the running call; cancelling it means that no callback comes
        """
        whole = url if urlsplit(url).scheme else f"{self.base_url}/{url.lstrip('/')}"
        task = asyncio.get_running_loop().create_task(self._report(whole, args, on_result, on_error, timeout))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def download(
        self,
        path: str,
        destination: Path | Writer,
        limit: int,
        timeout: float = 60.0,
        on_progress: Progress | None = None,
    ) -> int:
        """Stream `path` (a path on this platform, or a whole URL) into a file or a writer; return the bytes written.

        What was written before an error stays: write aside and rename.

        :param limit: bytes; one more is `Invalid`
        :param timeout: seconds for the whole transfer, so a trickling server cannot hold it; silence ends it after `IDLE`
        :raises HopError: `Refused` for 4xx (with `.status`), `Unreachable`, `Invalid`
        """
        url = path if urlsplit(path).scheme else f"{self.base_url}/{path.lstrip('/')}"
        if isinstance(destination, Path):
            with destination.open("wb") as file:
                return await self._stream(url, file.write, limit, timeout, on_progress)
        return await self._stream(url, destination, limit, timeout, on_progress)

    async def close(self) -> None:
        """End the calls begun by `with_url` and let go of the connections."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._client is not None:
            self._client.close()
            self._client = None

    async def _call(self, url: str, args: Mapping[str, Any], files: Mapping[str, Path], timeout: float) -> Any:
        kind, body = await _body(args, files)
        headers = {"Content-Type": kind, "Accept": "application/json"}
        request = HTTPRequest(url, method="POST", headers=headers, body=body)
        if self._client is None:
            self._client = self._connections(max_clients=CLIENTS, max_buffer_size=MAX_ANSWER)
        response = await self._fetch(self._client, request, timeout)
        return _result(url, response)

    def _connections(self, **bounds: int) -> SimpleAsyncHTTPClient:
        if self._socket_path is not None:
            return socket_connections(self._socket_path, **bounds)
        return SimpleAsyncHTTPClient(force_instance=True, **bounds)

    async def _fetch(self, client: SimpleAsyncHTTPClient, request: HTTPRequest, timeout: float) -> HTTPResponse:
        if not (math.isfinite(timeout) and timeout > 0):
            raise Invalid(f"cannot call within {timeout} s: give a time above zero")
        request.request_timeout = timeout
        request.connect_timeout = min(self._connect_timeout, timeout)
        request.follow_redirects = False
        if self._token and _origin(request.url) == _origin(self.base_url):
            request.headers["Accept-Token"] = self._token
        where = request.url.partition("?")[0]
        try:
            return await client.fetch(request, raise_error=False)
        except HTTPTimeoutError:
            raise Unreachable(f"cannot reach {where} within {timeout:g} s: try again later") from None
        except HTTPStreamClosedError:
            raise Unreachable(f"cannot read the answer of {where}: the connection was cut, try again") from None
        except (OSError, HTTPClientError) as error:
            raise Unreachable(f"cannot reach {where}: {error}, try again later") from None
        except UnsatisfiableReadError:
            raise Invalid(f"cannot read the answer of {where}: its headers have no end") from None
        except ValueError as error:
            raise Invalid(f"cannot call {where}: {error}") from None

    async def _stream(self, url: str, write: Writer, limit: int, timeout: float, on_progress: Progress | None) -> int:
        sink = Sink(url, write, limit, on_progress)
        request = HTTPRequest(
            url, headers={"Accept-Encoding": "identity"}, decompress_response=False,
            header_callback=sink.header, streaming_callback=sink.data,
        )  # fmt: skip
        # An instance of its own: the bound on the body is the client's, not the request's. It is wider than ours, so
        # that the sink sees the first byte too many and can say what was wrong.
        client = self._connections(max_clients=1, max_body_size=limit + OVERRUN)
        loop = asyncio.get_running_loop()
        try:
            async with asyncio.timeout(IDLE) as silence:
                sink.on_piece = lambda: silence.reschedule(loop.time() + IDLE)
                response = await self._fetch(client, request, timeout)
        except TimeoutError:
            raise Unreachable(f"cannot fetch {url}: nothing came for {IDLE:g} s, try again later") from None
        except Unreachable:
            sink.check()
            raise
        finally:
            sink.stop()
            client.close()
        sink.check()
        if response.code != 200:
            raise _BY_STATUS.get(response.code, Refused)(f"cannot fetch {url}: HTTP {response.code}", response.code)
        return sink.received

    async def _report(
        self,
        url: str,
        args: Mapping[str, Any],
        on_result: Callable[[Any], None],
        on_error: Callable[[HopError], None],
        timeout: float,
    ) -> None:
        try:
            result = await self._call(url, args, {}, timeout)
        except HopError as error:
            on_error(error)
        else:
            on_result(result)


def socket_connections(path: Path, **bounds: int) -> SimpleAsyncHTTPClient:
    """Return a client whose every connection goes to one UNIX socket."""
    client = SimpleAsyncHTTPClient(force_instance=True, **bounds)
    client.tcp_client.close()
    client.tcp_client = _SocketClient(path)
    return client


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


async def _body(args: Mapping[str, Any], files: Mapping[str, Path]) -> tuple[str, bytes]:
    arguments = strict_json.dumps(dict(args)).encode()
    if not files:
        return "application/json", arguments
    boundary = secrets.token_hex(16)
    parts = [_part(boundary, 'name="json"', "application/json", arguments)]
    size = len(arguments)
    for name, path in files.items():
        data = await asyncio.to_thread(_read, path)
        size += len(data)
        if size > MAX_UPLOAD:
            raise Refused(f"cannot upload {size} bytes: at most {MAX_UPLOAD} are allowed")
        field = f'name="{quote(name)}"; filename="{quote(path.name)}"'
        parts.append(_part(boundary, field, "application/octet-stream", data))
    return f"multipart/form-data; boundary={boundary}", b"".join(parts) + f"--{boundary}--\r\n".encode()


def _part(boundary: str, field: str, kind: str, data: bytes) -> bytes:
    head = f"--{boundary}\r\nContent-Disposition: form-data; {field}\r\nContent-Type: {kind}\r\n\r\n"
    return head.encode() + data + b"\r\n"


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAX_UPLOAD + 1)
    except OSError as error:
        raise Refused(f"cannot upload {path.name}: {error.strerror}") from None


def _result(url: str, response: HTTPResponse) -> Any:
    if response.code == 200:
        return strict_json.loads(response.body, limit=MAX_ANSWER)
    where = url.partition("?")[0]
    try:
        said = strict_json.loads(response.body, limit=MAX_ANSWER)["error"]
        raise from_wire(str(said["kind"]), str(said["message"]), response.code)
    except (Invalid, KeyError, TypeError) as error:
        if isinstance(error, Invalid) and error.status is not None:
            raise
        leaf = _BY_STATUS.get(response.code, Invalid)
        raise leaf(f"cannot call {where}: it answered HTTP {response.code}", response.code) from None


def _origin(url: str) -> tuple[str, str | None, int]:
    parts = urlsplit(url)
    return parts.scheme, parts.hostname, parts.port or (443 if parts.scheme == "https" else 80)
