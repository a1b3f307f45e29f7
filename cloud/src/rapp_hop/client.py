"""The calling half of HOP: `await client.call(...)`, callbacks with `with_url`, files sent and received in pieces.

Own JSON form of the contract: `POST /hop/<name>`, named parameters in, bare result out; with files multipart, the
arguments in the field `json`. Redirects are never followed: they would carry the token to a foreign host. `hop_peer` calls
the services of a real Hop server.
"""

import asyncio
import os
import random
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast
from urllib.parse import quote, urlencode, urlsplit

from tornado.httpclient import HTTPRequest, HTTPResponse
from tornado.simple_httpclient import SimpleAsyncHTTPClient

from rapp_hop import strict_json
from rapp_hop.connecting import BY_STATUS, NOT_SENT, fetch, make_connections, origin
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable, from_wire
from rapp_hop.protocol import TURNED_AWAY
from rapp_hop.streaming import PARTIAL, Progress, Sink, Writer
from rapp_hop.uploading import ASK_FIRST, Parcel, pack_json, pack_multipart

MAX_ANSWER = 16 * 2**20  # bytes of one JSON answer
OVERRUN = 2**20  # bytes of a download beyond its limit before the connection is cut
IDLE = 10.0  # seconds in which nothing comes of a download before it is given up
CLIENTS = 64  # calls of one client on the wire at once; more wait, so that one slow call does not hold up the next
PAUSE = 0.1  # seconds before the first repetition, doubled with each


class HopClient:
    """A caller of one platform's services; use it inside a running asyncio loop and `close()` it at the end."""

    def __init__(
        self,
        base_url: str,
        token: str | None = None,
        connect_timeout: float = 5.0,
        socket_path: Path | None = None,
        ca_file: Path | None = None,
        retries: int = 0,
    ) -> None:
        """Remember where to call; opens nothing yet.

        :param base_url: such as http://127.0.0.1:9001
        :param token: sent as `Accept-Token` to that platform only
        :param connect_timeout: seconds
        :param socket_path: of a UNIX socket on which the platform serves; the URL then only fills the header `Host`
        :param ca_file: certificates (PEM) that may vouch for the platform, the system's when None
        :param retries: how often a call is repeated within its time. Repeated is only what is safe: a call of which nothing
            was sent, and one that was turned away before it began. One that was cut may have run: a platform knows by an
            `Idempotency-Key` what it ran, but not what another of its processes did, or it itself before it was started anew
        :raises Invalid: when the URL is not an http(s) URL
        """
        self.base_url = base_url.rstrip("/")
        if urlsplit(self.base_url).scheme not in ("http", "https") or not urlsplit(self.base_url).hostname:
            raise Invalid(f"cannot call {base_url!r}: give a URL such as http://127.0.0.1:9001")
        self._token = token
        self._connect_timeout = connect_timeout
        self._socket_path = socket_path
        self._ca_file = ca_file
        self._retries = retries
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

        :param files: files to upload, by parameter name; a `Path` among the arguments is one too
        :param timeout: seconds for the whole call
        :raises HopError: a leaf by what to do next
        """
        return await self.call_url(f"/hop/{quote(service)}", {**(args or {}), **(files or {})}, timeout)

    async def call_url(self, url: str, args: Mapping[str, Any], timeout: float = 30.0, *, method: str = "POST") -> Any:
        """Call `url` and return its result (deliverable §4.4 `withURL`, awaited).

        :param url: a whole URL, or a path on this client's platform; the token goes to this platform only
        :param method: GET sends the arguments in the query, and takes text for a text
        :raises HopError: a leaf by what to do next
        """
        whole = self._whole(url)
        if method == "GET":
            query = urlencode({name: value if isinstance(value, str) else strict_json.dumps(value) for name, value in args.items()})
            response = await self._send(f"{whole}?{query}" if query else whole, None, timeout)
        else:
            response = await self._send(whole, await _pack(args), timeout)
        return _result(whole, response, texts=method == "GET")

    def with_url(
        self,
        url: str,
        args: Mapping[str, Any],
        on_result: Callable[[Any], None],
        on_error: Callable[[HopError], None],
        timeout: float = 30.0,
        *,
        method: str = "POST",
    ) -> asyncio.Task[None]:
        """As `call_url` in the background; exactly one callback runs later on this loop (deliverable §4.4 `withURL`).

        :return: the running call; cancelling it means that no callback comes
        """
        call = self.call_url(url, args, timeout, method=method)
        task = asyncio.get_running_loop().create_task(_report(call, on_result, on_error))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def fetch(
        self,
        service: str,
        args: Mapping[str, Any],
        destination: Path,
        limit: int,
        timeout: float = 60.0,
        on_progress: Progress | None = None,
    ) -> int:
        """Call a service that answers with a file or a stream; write it aside, then rename it to `destination`.

        :param limit: bytes; one more is `Invalid`
        :return: the bytes written; an error leaves nothing
        :raises HopError: a leaf by what to do next
        """
        parcel = await _pack(args)
        aside = destination.with_name(f".{destination.name}.{secrets.token_hex(6)}")
        try:
            with aside.open("xb") as file:
                count = await self._stream(self._whole(f"/hop/{quote(service)}"), parcel, file.write, limit, timeout, on_progress)
                await asyncio.to_thread(os.fsync, file.fileno())
            aside.replace(destination)
        except BaseException:
            aside.unlink(missing_ok=True)
            raise
        return count

    async def download(
        self,
        path: str,
        destination: Path | Writer,
        limit: int,
        timeout: float = 60.0,
        on_progress: Progress | None = None,
        start: int = 0,
    ) -> int:
        """Stream `path` (a path on this platform, or a whole URL) into a file or a writer; return its length in bytes.

        What was written before an error stays: write aside and rename.

        :param limit: bytes; one more is `Invalid`
        :param timeout: seconds for the whole transfer, so a trickling server cannot hold it; silence ends it after `IDLE`
        :param start: bytes that are here already: only what follows is fetched (HTTP Range) and written
        :raises HopError: `Refused` for 4xx (with `.status`), `Unreachable`, `Invalid`
        """
        url = self._whole(path)
        if isinstance(destination, Path):
            with destination.open("ab" if start else "wb") as file:
                return await self._stream(url, None, file.write, limit, timeout, on_progress, start)
        return await self._stream(url, None, destination, limit, timeout, on_progress, start)

    async def close(self) -> None:
        """End the calls begun by `with_url` and let go of the connections."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._client is not None:
            self._client.close()
            self._client = None

    async def _send(self, url: str, parcel: Parcel | None, timeout: float) -> HTTPResponse:
        if self._client is None:
            self._client = make_connections(self._socket_path, max_clients=CLIENTS, max_buffer_size=MAX_ANSWER)
        loop = asyncio.get_running_loop()
        end = loop.time() + timeout
        for attempt in range(self._retries + 1):
            request = await self._request(url, parcel)
            left = end - loop.time() if attempt else timeout
            pause = PAUSE * 2**attempt * random.uniform(0.5, 1.5)
            try:
                response = await fetch(self._client, request, left, self._connect_timeout)
            except Unreachable as error:
                if error.reason != NOT_SENT or attempt == self._retries or loop.time() + pause >= end:
                    raise
            else:
                if "Retry-After" not in response.headers or attempt == self._retries or loop.time() + pause >= end:
                    return response
            await asyncio.sleep(pause)
        raise AssertionError("the last attempt returns or raises")

    async def _stream(
        self, url: str, parcel: Parcel | None, write: Writer, limit: int, timeout: float, on_progress: Progress | None,
        start: int = 0,
    ) -> int:  # fmt: skip
        sink = Sink(url, write, limit, on_progress, start)
        request = await self._request(url, parcel)
        if start:
            request.headers["Range"] = f"bytes={start}-"
        request.headers["Accept-Encoding"] = "identity"
        request.decompress_response = False
        request.header_callback, request.streaming_callback = sink.header, sink.data
        # An instance of its own: the bound on the body is the client's, not the request's. It is wider than ours, so
        # that the sink sees the first byte too many and can say what was wrong.
        client = make_connections(self._socket_path, max_clients=1, max_body_size=limit + OVERRUN)
        loop = asyncio.get_running_loop()
        patience = IDLE if parcel is None else timeout  # a service may think for as long as it is given
        try:
            async with asyncio.timeout(patience) as silence:
                sink.on_piece = lambda: silence.reschedule(loop.time() + IDLE)
                response = await fetch(client, request, timeout, self._connect_timeout)
        except TimeoutError:
            raise Unreachable(f"cannot fetch {url}: nothing came for {IDLE:g} s, try again later") from None
        except Unreachable:
            sink.check()
            raise
        finally:
            sink.stop()
            client.close()
        sink.check()
        if response.code not in (200, PARTIAL if start else 200):
            _fail(url, response.code, sink.refusal, response.headers.get("Retry-After") is not None)
        return sink.received

    async def _request(self, url: str, parcel: Parcel | None) -> HTTPRequest:
        headers = {"Accept": "application/json"} if parcel is not None else {}
        if self._token and self._own(url):
            headers["Accept-Token"] = self._token
        ca_certs = str(self._ca_file) if self._ca_file is not None else None
        if parcel is None:
            return HTTPRequest(url, headers=headers, ca_certs=ca_certs)
        headers |= {"Content-Type": parcel.content_type, "Content-Length": str(parcel.length)}
        if parcel.length <= ASK_FIRST:
            return HTTPRequest(url, "POST", headers, await parcel.whole(), ca_certs=ca_certs)
        producer = cast(Callable[[Callable[[bytes], None]], "asyncio.Future[None]"], parcel.send)  # it awaits what it calls
        return HTTPRequest(url, "POST", headers, body_producer=producer, ca_certs=ca_certs, expect_100_continue=True)

    def _whole(self, url: str) -> str:
        return url if urlsplit(url).scheme else f"{self.base_url}/{url.lstrip('/')}"

    def _own(self, url: str) -> bool:
        return origin(url) == origin(self.base_url)


async def _report(call: Any, on_result: Callable[[Any], None], on_error: Callable[[HopError], None]) -> None:
    try:
        result = await call
    except HopError as error:
        on_error(error)
    else:
        on_result(result)


async def _pack(args: Mapping[str, Any]) -> Parcel:
    files = {name: value for name, value in args.items() if isinstance(value, Path)}
    if not files:
        return pack_json(args)
    plain = {name: value for name, value in args.items() if name not in files}
    return await pack_multipart({"json": ("application/json", strict_json.dumps(plain).encode())}, files)


def _result(url: str, response: HTTPResponse, *, texts: bool) -> Any:
    if response.code != 200:
        _fail(url, response.code, response.body, "Retry-After" in response.headers)
    kind = response.headers.get("Content-Type", "").partition(";")[0].strip().lower()
    if texts and kind.startswith("text/"):
        return response.body.decode("utf-8", "replace")
    if kind not in ("", "application/json"):
        raise Invalid(f"cannot take the answer of {url.partition('?')[0]} as a value: it is a file, use fetch")
    return strict_json.loads(response.body, limit=MAX_ANSWER)


def _fail(url: str, status: int, body: bytes, turned_away: bool) -> None:
    where = url.partition("?")[0]
    try:
        said = strict_json.loads(body, limit=MAX_ANSWER)["error"]
        error = from_wire(str(said["kind"]), str(said["message"]), status)
    except (Invalid, KeyError, TypeError):
        error = BY_STATUS.get(status, Refused if 300 <= status < 500 else Invalid)(
            f"cannot call {where}: it answered HTTP {status}", status
        )
    error.reason = TURNED_AWAY if turned_away else ""
    raise error
