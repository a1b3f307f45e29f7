"""The serving half of HOP: Tornado's HTTP server outside, `forms`, `service` and `runner` inside.

Before a byte of a body is taken the caller is known and the length is allowed. Errors are answered in the caller's form
with a kind and a message; what went wrong inside is logged here and never sent.
"""

import asyncio
import contextlib
import functools
import logging
import socket
import ssl
import sys
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPConnection, HTTPMessageDelegate, HTTPServerConnectionDelegate
from tornado.netutil import bind_sockets, bind_unix_socket

from rapp_hop.accepting import Door
from rapp_hop.callers import check_origin, token_of
from rapp_hop.calls import MountJob, ServiceJob, note
from rapp_hop.connection import Message
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_hop.fairness import Brake, Fairness
from rapp_hop.forms import OWN, form_of
from rapp_hop.heading import long_head
from rapp_hop.heads import Head, Job
from rapp_hop.mounts import Mount
from rapp_hop.page import load_pages
from rapp_hop.protocol import Form, WireAnswer
from rapp_hop.registry import ServiceRegistry
from rapp_hop.repeats import Repeats
from rapp_hop.runner import Runner
from rapp_hop.sending import head_of
from rapp_hop.service import BASE, Authenticate
from rapp_hop.spool import Room, Spool
from rapp_hop.streams import PatientStream, PatientTlsStream

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ServerLimits:
    """Bounds of one server."""

    headers: int = 16 * 1024  # bytes
    header_timeout: float = 20.0  # seconds to send the headers
    body_timeout: float = 60.0  # seconds to send a body
    idle_timeout: float = 60.0  # seconds between two requests of a connection
    send_timeout: float = 60.0  # seconds in which a peer takes nothing of an answer
    connections: int = 1000  # at once
    connections_of_one: int = 300  # of one address
    spooled: int = 2**30  # bytes of all bodies together, in memory and on the disk
    rate: float = 1000.0  # calls per second of one caller
    burst: float = 2000.0  # calls of one caller at once
    log_lines: int = 50  # per second
    drain: float = 1.0  # seconds for running calls when the server ends


class HopServer:
    """An HTTP server of HOP services, of the page on which to try them, and of mounts beside them."""

    def __init__(
        self,
        registry: ServiceRegistry,
        authenticate: Authenticate,
        uploads: Path,
        mounts: Iterable[Mount] = (),
        limits: ServerLimits | None = None,
        runner: Runner | None = None,
        tls: ssl.SSLContext | None = None,
    ) -> None:
        """Prepare; opens no port yet. Needs a running loop.

        :param authenticate: from a token (`Accept-Token`, or `Authorization`) to the caller, None for nobody
        :param uploads: folder for files while a call runs
        :param runner: another server's, whose places are shared; that server closes it
        :param tls: what `listen` speaks TLS with; UNIX sockets speak none
        """
        self.limits = limits or ServerLimits()
        self.registry = registry
        self.runner = runner or Runner()
        self._own_runner = runner is None
        self.repeats = Repeats(time.monotonic)
        self.uploads = uploads
        self._room = Room(self.limits.spooled)
        self.brake = Brake(self.limits.log_lines, time.monotonic)
        self.header_bytes = self.limits.headers
        self.header_timeout = self.limits.header_timeout
        self.body_timeout = self.limits.body_timeout
        self.send_timeout = self.limits.send_timeout
        self._authenticate = authenticate
        self._mounts = tuple(mounts)
        self._pages = load_pages()
        self._farewells = (
            self._last_words(Invalid("cannot read the request: it is no HTTP")),
            self._last_words(long_head(self.header_bytes)),
        )
        self._fairness = Fairness(self.limits.rate, self.limits.burst, time.monotonic)
        self._tls = tls
        self._loop = asyncio.get_running_loop()
        # Tornado's own limit on bodies would answer with a bare 400; each job has its own.
        self._http = HTTPServer(_Requests(self), max_header_size=self.limits.headers, max_body_size=sys.maxsize,
                                idle_connection_timeout=self.limits.idle_timeout)  # fmt: skip
        self._messages: dict[PatientStream | PatientTlsStream, Message] = {}  # the one each connection has
        self._running: set[Message] = set()
        self._streams: dict[PatientStream | PatientTlsStream, str] = {}
        self._of_address: Counter[str] = Counter()
        self._doors: list[Door] = []
        self._sweeping = self._loop.create_task(self._sweep())
        self._warming: asyncio.Task[None] | None = None

    def listen(self, port: int, address: str = "127.0.0.1") -> int:
        """Listen and return the port (an ephemeral one when 0 is given).

        :raises Refused: when the port cannot be had
        """
        try:
            sockets = bind_sockets(port, address)
        except OSError as error:
            raise Refused(f"cannot listen on {address}:{port}: {error.strerror}, choose another port") from None
        for one in sockets:
            self.listen_on(one, self._tls)
        return int(sockets[0].getsockname()[1])

    def listen_unix(self, path: Path, mode: int = 0o600) -> None:
        """Listen on a UNIX socket at `path`; a dead one that lies there is replaced.

        :param mode: who may connect
        :raises Refused: when it cannot be had
        """
        try:
            self.listen_on(bind_unix_socket(str(path), mode))
        except (OSError, ValueError) as error:
            raise Refused(f"cannot listen on {path}: {error}, choose another path") from None

    def listen_on(self, listening: socket.socket, tls: ssl.SSLContext | None = None) -> None:
        """Serve on a socket that listens already; processes that share it share its callers."""
        self._doors.append(Door(listening, functools.partial(self._accept, tls)))
        if self._warming is None:
            self._warming = self._loop.create_task(self.runner.warm(self.registry))

    async def close(self) -> None:
        """Take no new connections, give running calls a moment, end."""
        for door in self._doors:
            door.close()
        end = self._loop.time() + self.limits.drain
        while self._running and self._loop.time() < end:
            await asyncio.sleep(0.02)
        self._sweeping.cancel()
        for message in list(self._running):
            message.cancel()
        await self._http.close_all_connections()
        await asyncio.gather(self._sweeping, *([self._warming] if self._warming else []), return_exceptions=True)
        if self._own_runner:
            await self.runner.close()

    def start_request(self, line: HTTPConnection) -> Message:
        """Expect the next request of a connection."""
        stream = line.stream  # type: ignore[attr-defined]
        message = Message(self, line, stream, self._streams.get(stream, ""))
        self._messages[stream] = message
        return message

    def running(self, message: Message, is_so: bool) -> None:
        """Know which requests are being answered."""
        (self._running.add if is_so else self._running.discard)(message)

    def _accept(self, tls: ssl.SSLContext | None, connection: socket.socket, peer: Any) -> None:
        address = peer[0] if isinstance(peer, tuple) else ""
        if len(self._streams) >= self.limits.connections or (
            address and self._of_address[address] >= self.limits.connections_of_one
        ):
            error = Unreachable("cannot serve so many connections: try again later", 503)
            connection.setblocking(False)
            with contextlib.suppress(OSError):
                connection.send(self._last_words(error) if tls is None else b"")
            connection.close()
            return
        stream = self._stream(connection, tls)
        stream.malformed, stream.too_long = self._farewells
        stream.on_closed = functools.partial(self._forget, stream)
        self._streams[stream] = address
        self._of_address[address] += 1
        stream.set_nodelay(True)
        self._http.handle_stream(stream, peer)

    def _stream(self, connection: socket.socket, tls: ssl.SSLContext | None) -> PatientStream | PatientTlsStream:
        if tls is None:
            return PatientStream(connection)
        wrapped = tls.wrap_socket(connection, server_side=True, do_handshake_on_connect=False)
        return PatientTlsStream(wrapped)

    def _last_words(self, error: HopError) -> bytes:
        answer = OWN.write_error(error, None)
        assert isinstance(answer.body, bytes)
        return head_of(answer, False, len(answer.body)) + answer.body

    def _forget(self, stream: PatientStream | PatientTlsStream) -> None:
        self._messages.pop(stream, None)
        address = self._streams.pop(stream, "")
        self._of_address[address] -= 1
        if self._of_address[address] <= 0:
            del self._of_address[address]

    def spool(self) -> Spool:
        """Return a place for a body."""
        return Spool(self.uploads, self._room)

    def malformed(self, error: HopError) -> WireAnswer:
        """Return the answer for what is no request."""
        if self.brake.allows():
            _log.info("%s", str(error)[:200])
        return OWN.write_error(error, None)

    def begin(self, head: Head) -> Job | WireAnswer:
        """Return who answers a request, or the answer."""
        if head.path in self._pages and head.method in ("GET", "HEAD"):
            return self._pages[head.path]
        form: Form = OWN
        wrong: HopError | None = None
        try:
            form = form_of(head.method, head.headers, head.query)
        except HopError as error:
            wrong = error
        try:
            return self._begin(head, form, wrong)
        except HopError as error:
            note(self.brake, head, error)
            return form.write_error(error, None)

    def _begin(self, head: Head, form: Form, wrong: HopError | None) -> Job | WireAnswer:
        mount = next((one for one in self._mounts if head.path.startswith(one.prefix)), None)
        if mount is not None and mount.public:
            return self._mounted(head, "", mount, form)
        if mount is None and not head.path.startswith(BASE):
            raise Refused("cannot find this page: see /hop/available_services", 404)
        check_origin(head.headers)
        caller = self._authenticate(token_of(head.headers))
        if caller is None:
            raise Refused("cannot serve this caller: send a valid Accept-Token", 401)
        self._fairness.admit(caller)
        if mount is not None:
            return self._mounted(head, caller, mount, form)
        item = self.registry.at(head.path)
        if wrong is not None:
            raise wrong
        if head.method == "HEAD":
            return WireAnswer(200, "text/plain", b"")
        return ServiceJob(self, head, caller, item, form)

    def _mounted(self, head: Head, caller: str, mount: Mount, form: Form) -> Job:
        if head.method not in mount.methods:
            raise Refused(f"cannot serve {head.method} here", 405)
        return MountJob(self.brake, head, caller, mount, form)

    async def _sweep(self) -> None:
        period = min(max(min(self.header_timeout, self.body_timeout) / 4, 0.02), 0.25)
        while True:
            await asyncio.sleep(period)
            now = self._loop.time()
            for message in list(self._messages.values()):
                if message.deadline is not None and now > message.deadline:
                    message.overdue()
                elif message.stream.expecting and now - (message.stream.began or now) > self.header_timeout:
                    self._too_slow(message.stream)

    def _too_slow(self, stream: PatientStream | PatientTlsStream) -> None:
        stream.write(self._last_words(Unreachable("cannot wait any longer for the headers of the request", 408)))
        stream.close()


class _Requests(HTTPServerConnectionDelegate):
    """Tornado's way to ask who takes a request."""

    def __init__(self, server: HopServer) -> None:
        self._server = server

    def start_request(self, server_conn: object, request_conn: HTTPConnection) -> HTTPMessageDelegate:
        """See Tornado."""
        return self._server.start_request(request_conn)
