"""The serving half of HOP: connections outside, `forms`, `service` and `runner` inside.

Before a byte of a body is taken the caller is known and the length is allowed. Errors are answered in the caller's form
with a kind and a message; what went wrong inside is logged here and never sent.
"""

import asyncio
import base64
import binascii
import logging
import socket
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from tornado.netutil import bind_sockets, bind_unix_socket

from rapp_hop.calls import MountJob, ServiceJob, note
from rapp_hop.connection import Connection
from rapp_hop.errors import HopError, Refused, Unreachable
from rapp_hop.fairness import Brake, Fairness
from rapp_hop.forms import OWN, form_of
from rapp_hop.heads import Head, Job
from rapp_hop.mounts import Mount
from rapp_hop.page import load_pages
from rapp_hop.protocol import Form, WireAnswer
from rapp_hop.registry import ServiceRegistry
from rapp_hop.repeats import Repeats
from rapp_hop.runner import Runner
from rapp_hop.service import BASE, Authenticate
from rapp_hop.spool import Spool

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
    ) -> None:
        """Prepare; opens no port yet. Needs a running loop.

        :param authenticate: from a token (`Accept-Token`, or `Authorization`) to the caller, None for nobody
        :param uploads: folder for files while a call runs
        """
        self.limits = limits or ServerLimits()
        self.registry = registry
        self.runner = Runner()
        self.repeats = Repeats(time.monotonic)
        self.uploads = uploads
        self.brake = Brake(self.limits.log_lines, time.monotonic)
        self.header_bytes = self.limits.headers
        self.header_timeout = self.limits.header_timeout
        self.body_timeout = self.limits.body_timeout
        self.idle_timeout = self.limits.idle_timeout
        self.send_timeout = self.limits.send_timeout
        self._authenticate = authenticate
        self._mounts = tuple(mounts)
        self._pages = load_pages()
        self._fairness = Fairness(self.limits.rate, self.limits.burst, time.monotonic)
        self._loop = asyncio.get_running_loop()
        self._connections: set[Connection] = set()
        self._of_address: dict[str, int] = {}
        self._servers: list[asyncio.Task[asyncio.Server]] = []
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
            self.listen_on(one)
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

    def listen_on(self, listening: socket.socket) -> None:
        """Serve on a socket that listens already; processes that share it share its callers."""
        unix = listening.family == socket.AF_UNIX
        create = self._loop.create_unix_server if unix else self._loop.create_server
        self._servers.append(self._loop.create_task(create(lambda: Connection(self, self._loop), sock=listening)))
        if self._warming is None:
            self._warming = self._loop.create_task(self.runner.warm(self.registry))

    async def close(self) -> None:
        """Take no new connections, give running calls a moment, end."""
        for server in await asyncio.gather(*self._servers):
            server.close()
        end = self._loop.time() + self.limits.drain
        while any(connection.busy for connection in self._connections) and self._loop.time() < end:
            await asyncio.sleep(0.02)
        self._sweeping.cancel()
        for connection in list(self._connections):
            connection.close()
        await asyncio.gather(self._sweeping, *([self._warming] if self._warming else []), return_exceptions=True)
        await self.runner.close()

    # the connections' side, see `connection.Site`

    def opened(self, connection: Connection) -> HopError | None:
        """Count a connection; turn it away when there are too many."""
        self._connections.add(connection)
        count = self._of_address[connection.address] = self._of_address.get(connection.address, 0) + 1
        if len(self._connections) > self.limits.connections or (connection.address and count > self.limits.connections_of_one):
            return Unreachable("cannot serve so many connections: try again later", 503)
        return None

    def closed(self, connection: Connection) -> None:
        """Forget a connection."""
        self._connections.discard(connection)
        left = self._of_address.pop(connection.address, 1) - 1
        if left > 0:
            self._of_address[connection.address] = left

    def spool(self) -> Spool:
        """Return a place for a body."""
        return Spool(self.uploads)

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
        _check_origin(head.headers)
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
        bounds = (self.header_timeout, self.body_timeout, self.idle_timeout, self.send_timeout)
        period = min(max(min(bounds) / 4, 0.02), 1.0)
        while True:
            await asyncio.sleep(period)
            now = self._loop.time()
            for connection in list(self._connections):
                if connection.deadline is not None and now > connection.deadline:
                    connection.overdue()


def token_of(headers: Mapping[str, str]) -> str | None:
    """Return the token of a request: `Accept-Token`, or `Authorization` (Bearer, or Basic with it as password).

    :raises Refused: with status 401, when there are two that differ
    """
    own = headers.get("accept-token")
    authorization = headers.get("authorization")
    if authorization is None:
        return own
    other = _authorized(authorization)
    if own is not None and own != other:
        raise Refused("cannot tell who calls: Accept-Token and Authorization differ", 401)
    return other


def _authorized(value: str) -> str | None:
    scheme, _, rest = value.partition(" ")
    if scheme.lower() == "bearer":
        return rest.strip()
    if scheme.lower() != "basic":
        return None
    try:
        return base64.b64decode(rest.strip(), validate=True).decode("utf-8").partition(":")[2]
    except (binascii.Error, UnicodeDecodeError):
        return None


def _check_origin(headers: Mapping[str, str]) -> None:
    """A browser on somebody else's page must not call in the name of its user (input H20)."""
    origin = headers.get("origin")
    foreign = origin is not None and urlsplit(origin).netloc.lower() != headers.get("host", "").lower()
    if foreign or headers.get("sec-fetch-site") in ("cross-site", "same-site"):
        raise Refused("cannot serve another site's page: open the platform's own", 403)
