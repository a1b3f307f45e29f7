"""The SMTP server: aiosmtpd's protocol, our rules on recipients, and the postbox behind it."""

import asyncio
import logging
import socket
import ssl
from collections.abc import Sequence
from typing import Any

from aiosmtpd.smtp import SMTP, AuthResult, Envelope, LoginPassword, Session

from rapp_cloud.mail.addresses import check_address
from rapp_cloud.mail.config import Config, Limits
from rapp_cloud.mail.errors import Invalid, MailError, Refused
from rapp_cloud.mail.postbox import Postbox
from rapp_cloud.mail.users import Users

_log = logging.getLogger(__name__)


class Handler:
    """What aiosmtpd asks at each command; every answer is one SMTP reply line."""

    def __init__(self, postbox: Postbox, domains: Sequence[str], limits: Limits) -> None:
        self._postbox = postbox
        self._domains = domains
        self._limits = limits

    async def handle_MAIL(self, _s: SMTP, _e: Session, envelope: Envelope, address: str, options: list[str]) -> str:  # noqa: N802
        """Take the sender when it is an address."""
        try:
            envelope.mail_from = check_address(address)
        except Refused as error:
            return error.reply
        envelope.mail_options.extend(options)
        return "250 2.1.0 OK"

    async def handle_RCPT(self, _s: SMTP, _e: Session, envelope: Envelope, address: str, options: list[str]) -> str:  # noqa: N802
        """Take a recipient that is an address of a domain we serve (553, 550, 452 else)."""
        if len(envelope.rcpt_tos) >= self._limits.recipients:
            return "452 4.5.3 too many recipients, send to the others in another message"
        try:
            envelope.rcpt_tos.append(check_address(address, self._domains))
        except Refused as error:
            return error.reply
        envelope.rcpt_options.extend(options)
        return "250 2.1.5 OK"

    async def handle_DATA(self, _s: SMTP, _e: Session, envelope: Envelope) -> str:  # noqa: N802
        """Deliver; answers 250 only when the message is on the disk, or was before."""
        content = envelope.original_content or b""
        try:
            path = await asyncio.to_thread(self._postbox.deliver, content, envelope.mail_from or "", envelope.rcpt_tos)
        except MailError as error:
            _log.warning("%s", error)
            return error.reply
        _log.info("delivered to %s: %s", ", ".join(envelope.rcpt_tos), path.name if path else "had it already")
        return "250 2.0.0 OK, delivered"


class Connection(SMTP):  # type: ignore[misc]  # aiosmtpd's types are not looked at
    """One client's connection, known to its server so that all can be ended."""

    def __init__(self, handler: Handler, open_now: "set[Connection]", limit: int, **settings: Any) -> None:
        super().__init__(handler, **settings)
        self._open_now = open_now
        self._limit = limit

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin, or send away with 421 when too many are here (called again after STARTTLS)."""
        if self not in self._open_now and len(self._open_now) >= self._limit and isinstance(transport, asyncio.WriteTransport):
            transport.write(b"421 4.3.2 too many connections, try again later\r\n")
            super().connection_made(transport)
            transport.close()
            return
        self._open_now.add(self)
        super().connection_made(transport)

    def connection_lost(self, error: Exception | None) -> None:
        """Forget the connection."""
        self._open_now.discard(self)
        super().connection_lost(error)

    def abort(self) -> None:
        """End the connection at once."""
        if isinstance(self.transport, asyncio.Transport):
            self.transport.abort()


class MailServer:
    """A listening SMTP server; `start` has its undo in `stop`."""

    def __init__(self, config: Config) -> None:
        """Read certificate and users; listens not yet.

        :raises Invalid: a file of the settings is wrong
        :raises Unreachable: the Maildir cannot be used
        """
        self._config = config
        self._handler = Handler(Postbox(config.maildir, config.limits.remembered), config.domains, config.limits)
        self._tls = _tls(config)
        self._users = Users.load(config.users_file) if config.users_file else None
        self._open: set[Connection] = set()
        self._server: asyncio.Server | None = None

    async def start(self) -> int:
        """Listen; returns the port.

        :raises Invalid: the port cannot be had
        """
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(self._connection, self._config.address, self._config.port)
        except OSError as error:
            raise Invalid(f"cannot listen on {self._config.address}:{self._config.port}: {error.strerror}") from None
        return int(self._server.sockets[0].getsockname()[1])

    async def stop(self) -> None:
        """Stop listening and end every connection."""
        if self._server is None:
            return
        self._server.close()
        for connection in list(self._open):
            connection.abort()
        await self._server.wait_closed()
        self._server = None

    def _connection(self) -> Connection:
        return Connection(
            self._handler,
            self._open,
            self._config.limits.sessions,
            data_size_limit=self._config.limits.message,
            hostname=socket.gethostname(),
            ident="RAPP mail",
            tls_context=self._tls,
            require_starttls=self._users is not None,
            timeout=self._config.limits.idle,
            auth_required=self._users is not None,
            authenticator=self._authenticate,
            auth_exclude_mechanism=() if self._users else ("LOGIN", "PLAIN"),
            loop=asyncio.get_running_loop(),
        )

    def _authenticate(self, _s: SMTP, session: Session, _e: Envelope, _mechanism: str, data: Any) -> AuthResult:
        if not isinstance(data, LoginPassword) or self._users is None:
            return AuthResult(success=False, handled=False)
        try:
            known = self._users.check(data.login.decode(), data.password.decode())
        except UnicodeDecodeError:
            known = False
        _log.info("%s of %s", "login" if known else "refused login", session.peer)
        return AuthResult(success=known, handled=False, auth_data=data.login.decode("ascii", "replace") if known else None)


def _tls(config: Config) -> ssl.SSLContext | None:
    if config.certificate is None or config.key is None:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(config.certificate, config.key)
    except OSError as error:
        raise Invalid(f"cannot use {config.certificate} and {config.key}: {error}") from None
    return context
