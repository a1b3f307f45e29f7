"""The serving half of HOP: Tornado outside, `protocol`, `service` and `runner` inside.

Before a byte of a body is taken the caller is known and the length is allowed. Answers to errors have a kind and a
message; what went wrong inside is logged here and never sent.
"""

import asyncio
import logging
import secrets
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets, bind_unix_socket
from tornado.web import Application, HTTPError, RequestHandler, stream_request_body

from rapp_hop.errors import Bug, HopError, Invalid, Refused
from rapp_hop.protocol import JSON_FORM, Call, Form, WireAnswer, WireRequest, form_of
from rapp_hop.runner import Runner
from rapp_hop.service import Authenticate, Request, Service, ServiceRegistry

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ServerLimits:
    """Bounds of one server."""

    headers: int = 16 * 1024  # bytes
    body: int = 64 * 2**20  # bytes, of the service with the largest
    body_timeout: float = 60.0  # seconds to send a body
    idle_timeout: float = 60.0  # seconds between two requests of a connection
    drain: float = 1.0  # seconds for running calls when the server ends


class HopServer:
    """An HTTP server of HOP services and of other handlers beside them."""

    def __init__(
        self,
        registry: ServiceRegistry,
        authenticate: Authenticate,
        uploads: Path,
        others: Iterable[tuple[str, type[RequestHandler], dict[str, Any]]] = (),
        limits: ServerLimits | None = None,
    ) -> None:
        """Prepare; opens no port yet. Needs a running loop.

        :param authenticate: from the header `Accept-Token` to the caller, None for nobody
        :param uploads: folder for files while a call runs
        :param others: Tornado handlers for other URLs
        """
        self.limits = limits or ServerLimits()
        self.runner = Runner(registry)
        self.registry = registry
        self.authenticate = authenticate
        self.uploads = uploads
        self.busy = 0
        routes = [(r"/hop/([^/?]+)/?", HopHandler, {"server": self}), *others, (r".*", LostHandler, {})]
        application = Application(routes, log_function=_log_request)
        self._http = HTTPServer(
            application,
            max_header_size=self.limits.headers,
            max_body_size=self.limits.body,
            body_timeout=self.limits.body_timeout,
            idle_connection_timeout=self.limits.idle_timeout,
        )

    def listen(self, port: int, address: str = "127.0.0.1") -> int:
        """Listen and return the port (an ephemeral one when 0 is given).

        :raises Refused: when the port cannot be had
        """
        try:
            sockets = bind_sockets(port, address)
        except OSError as error:
            raise Refused(f"cannot listen on {address}:{port}: {error.strerror}, choose another port") from None
        self._http.add_sockets(sockets)
        return int(sockets[0].getsockname()[1])

    def listen_unix(self, path: Path, mode: int = 0o600) -> None:
        """Listen on a UNIX socket at `path`; a dead one that lies there is replaced.

        :param mode: who may connect
        :raises Refused: when it cannot be had
        """
        try:
            self._http.add_socket(bind_unix_socket(str(path), mode))
        except (OSError, ValueError) as error:
            raise Refused(f"cannot listen on {path}: {error}, choose another path") from None

    async def close(self) -> None:
        """Take no new connections, give running calls a moment, end."""
        self._http.stop()
        end = asyncio.get_running_loop().time() + self.limits.drain
        while self.busy and asyncio.get_running_loop().time() < end:
            await asyncio.sleep(0.02)
        self.runner.close()
        await self._http.close_all_connections()


class JsonErrors(RequestHandler):
    """Answers every error in our JSON form, without a stack trace."""

    def set_default_headers(self) -> None:
        """Name no software, let nobody guess types or keep answers."""
        self.set_header("Server", "rapp")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Cache-Control", "no-store")

    def write_error(self, status_code: int, **kwargs: Any) -> None:
        """Write the error that Tornado caught."""
        found = kwargs.get("exc_info", (None, None, None))[1]
        self.send(JSON_FORM.write_error(_as_hop_error(found, status_code)))

    def log_exception(
        self,
        typ: type[BaseException] | None,
        value: BaseException | None,
        tb: TracebackType | None,
    ) -> None:
        """Log what is our fault with its trace, the caller's in one line."""
        if isinstance(value, HopError) and not isinstance(value, Bug):
            _log.info("%s: %s", self.request.path[:100], value)
        else:
            super().log_exception(typ, value, tb)

    def send(self, answer: WireAnswer) -> None:
        """Finish with this answer."""
        self.set_status(answer.status)
        self.set_header("Content-Type", answer.content_type)
        self.finish(answer.body)


@stream_request_body
class LostHandler(JsonErrors):
    """Everything that is nowhere."""

    def data_received(self, chunk: bytes) -> None:
        """Throw the body away."""

    def prepare(self) -> None:
        """Say so."""
        raise Refused("cannot find this page: see /hop/available_services", 404)


@stream_request_body
class HopHandler(JsonErrors):
    """`/hop/<name>`."""

    _service: Service
    _caller: str
    _form: Form

    def initialize(self, server: HopServer) -> None:
        """Take the server."""
        self._server = server
        self._body = bytearray()

    def prepare(self) -> None:
        """Know the caller, the service, and whether the body may come."""
        caller = self._server.authenticate(self.request.headers.get("Accept-Token"))
        if caller is None:
            self._hang_up()
            raise Refused("cannot serve this caller: send a valid Accept-Token", 401)
        self._caller = caller
        self._service = self._server.registry.get(self.path_args[0])
        if self.request.method != "POST":
            raise Refused("cannot call a service so: use POST", 405)
        length = self.request.headers.get("Content-Length", "0")
        if length.isdecimal() and int(length) > self._service.max_body:
            self._hang_up()
            raise self._too_large()
        self._form = form_of(self._wire(b""))

    def data_received(self, chunk: bytes) -> None:
        """Collect the body within the service's bound."""
        if self._finished:
            return
        self._body += chunk
        if len(self._body) > self._service.max_body:
            self._body.clear()
            self._hang_up()
            self.send(JSON_FORM.write_error(self._too_large()))

    async def post(self, name: str) -> None:
        """Read, check, run, answer."""
        if self._finished:  # the body was too large
            return
        self._server.busy += 1
        try:
            call = self._form.read(self._wire(bytes(self._body)), self._service.name)
            self._body.clear()
            result = await self._run(call)
            self.send(self._form.write(result))
        finally:
            self._server.busy -= 1

    async def _run(self, call: Call) -> Any:
        request = Request(self._caller, self._service.name, _headers(self.request.headers), self.request.remote_ip or "")
        if not call.uploads:
            return await self._server.runner.run(self._service, self._service.bind(call.arguments, {}, request))
        self._server.uploads.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.TemporaryDirectory(dir=self._server.uploads) as folder:
            files = {upload.parameter: Path(folder, secrets.token_hex(8) + upload.suffix) for upload in call.uploads}
            arguments = self._service.bind(call.arguments, files, request)
            for upload in call.uploads:
                await asyncio.to_thread(files[upload.parameter].write_bytes, upload.data)
            return await self._server.runner.run(self._service, arguments)

    def _wire(self, body: bytes) -> WireRequest:
        return WireRequest(self.request.method or "", self.request.path, _headers(self.request.headers), body)

    def _too_large(self) -> Refused:
        return Refused(f"cannot take more than {self._service.max_body} bytes for {self._service.name}", 413)

    def _hang_up(self) -> None:
        self.set_header("Connection", "close")


def _headers(headers: Mapping[str, str]) -> dict[str, str]:
    return {name.lower(): value for name, value in headers.items()}


def _as_hop_error(found: BaseException | None, status: int) -> HopError:
    if isinstance(found, HopError):
        return found
    if isinstance(found, HTTPError) and found.status_code < 500:
        return Refused(f"cannot serve this request: HTTP {found.status_code}", found.status_code)
    if status < 500:
        return Invalid(f"cannot serve this request: HTTP {status}", status)
    return Bug("cannot finish the call: the platform has a fault of its own, which is in its log")


def _log_request(handler: RequestHandler) -> None:
    request = handler.request
    took = 1000 * request.request_time()
    _log.info("%s %s %s %.1f ms", handler.get_status(), request.method, request.path[:100], took)
