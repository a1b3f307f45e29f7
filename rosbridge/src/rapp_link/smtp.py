"""One try to hand a mail to the server (RFC 5321, 3207, 4954): smtplib in a thread, bounded, errors translated once.

Encryption asked for is never given up: no STARTTLS offered or a certificate that does not fit means no mail now.
"""

import smtplib
import socket
import ssl
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Protocol

from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_link.config import MailConfig
from rapp_link.letter import Outcome
from rapp_link.threads import in_thread

ACCOUNT = frozenset({530, 534, 535, 538})  # RFC 4954 §6: it is not the mail that is refused, but who sends it


class Locked(Unreachable):
    """The server does not let the robot's account in: not now, and not before somebody has mended it."""


class Sender(Protocol):
    """Hands a mail over."""

    async def send(self, sender: str, recipients: Sequence[str], content: bytes) -> Outcome:
        """Try once.

        :raises Refused: the server refuses the mail for good; the text has its words
        :raises Locked: it does not let the account in
        :raises Unreachable: not now
        :raises Invalid: the server's encryption or answers cannot be trusted; not now either
        """


class SmtpSender:
    """Hands mails to one server with one account."""

    def __init__(self, config: MailConfig) -> None:
        self._config = config

    async def send(self, sender: str, recipients: Sequence[str], content: bytes) -> Outcome:
        """Try once; see `Sender`."""
        return await in_thread(self._send, sender, recipients, content)

    def _send(self, sender: str, recipients: Sequence[str], content: bytes) -> Outcome:
        with _translated(self._config), self._session() as server:
            try:
                refused = server.sendmail(sender, list(recipients), content)
            except smtplib.SMTPRecipientsRefused as error:
                refused = error.recipients
        return _outcome(recipients, refused)

    @contextmanager
    def _session(self) -> Iterator[smtplib.SMTP]:
        config = self._config
        context = _context(config) if config.security != "none" else None
        server = _Tls(context, config.connect_timeout) if config.security == "tls" else _Plain(timeout=config.connect_timeout)
        limit = threading.Timer(config.transfer_timeout, _cut, (server,))
        limit.daemon = True
        limit.start()
        try:
            code, words = server.connect(config.host, config.port)
            if code != 220:
                raise smtplib.SMTPConnectError(code, words)
            if config.security == "starttls":
                server.ehlo()
                if not server.has_extn("starttls"):
                    raise Invalid(f"cannot send by {config.host}: it offers no STARTTLS, use its TLS port or another server")
                server.starttls(context=context)
            if config.user:
                server.login(config.user, config.password)
            yield server
            # The mail is taken: what goes wrong in the farewell changes nothing.
            with suppress(OSError, smtplib.SMTPException):
                server.quit()
        finally:
            limit.cancel()
            server.close()


class _Plain(smtplib.SMTP):
    """Knows the host it will talk to: `starttls` checks the certificate against it."""

    def __init__(self, timeout: float) -> None:
        super().__init__(local_hostname=socket.gethostname(), timeout=timeout)

    def connect(self, host: str = "localhost", port: int = 0, source_address: object = None) -> tuple[int, bytes]:
        self._host = host
        return super().connect(host, port)


class _Tls(smtplib.SMTP_SSL):
    """The same with TLS from the first byte."""

    def __init__(self, context: ssl.SSLContext | None, timeout: float) -> None:
        super().__init__(local_hostname=socket.gethostname(), timeout=timeout, context=context)

    def connect(self, host: str = "localhost", port: int = 0, source_address: object = None) -> tuple[int, bytes]:
        self._host = host
        return super().connect(host, port)


def _context(config: MailConfig) -> ssl.SSLContext:
    try:
        return ssl.create_default_context(cafile=str(config.ca_file) if config.ca_file else None)
    except OSError as error:
        raise Invalid(f"cannot read the certificate authority {config.ca_file}: {error}") from None


def _cut(server: smtplib.SMTP) -> None:
    """End a transfer that trickles: smtplib bounds each read, not the whole."""
    if server.sock is not None:
        with suppress(OSError):
            server.sock.shutdown(socket.SHUT_RDWR)


def _outcome(recipients: Sequence[str], refused: Mapping[str, tuple[int, bytes]]) -> Outcome:
    words = {name: _words(code, text) for name, (code, text) in refused.items()}
    good = {name: text for name, text in words.items() if refused[name][0] >= 500 and refused[name][0] not in ACCOUNT}
    later = {name: text for name, text in words.items() if name not in good}
    locked = any(refused[name][0] in ACCOUNT for name in later)
    return Outcome(tuple(name for name in recipients if name not in words), good, later, locked)


def _words(code: int, text: bytes | str) -> str:
    said = text.decode("utf-8", "replace") if isinstance(text, bytes) else text
    return f"{code} " + " ".join("".join(c if c.isprintable() else " " for c in said).split())[:200]


@contextmanager
def _translated(config: MailConfig) -> Iterator[None]:
    where = f"{config.host}:{config.port}"
    try:
        yield
    except HopError:
        raise
    except smtplib.SMTPResponseException as error:
        raise _said(where, error) from None
    except smtplib.SMTPNotSupportedError as error:
        raise Locked(f"cannot log in at {where}: {error}, give no account or another server") from None
    except smtplib.SMTPServerDisconnected:
        raise Unreachable(f"cannot send by {where}: the connection was cut, it is tried again") from None
    except ssl.SSLCertVerificationError as error:
        raise Invalid(f"cannot trust {where}: {error.verify_message}, check the server's name or give its authority") from None
    except (OSError, smtplib.SMTPException) as error:
        raise Unreachable(f"cannot reach the mail server {where}: {error}, it is tried again") from None


def _said(where: str, error: smtplib.SMTPResponseException) -> HopError:
    words = f"the server says {_words(error.smtp_code, error.smtp_error)}"
    if isinstance(error, smtplib.SMTPAuthenticationError) or error.smtp_code in ACCOUNT:
        return Locked(f"cannot log in at {where}: {words}, check name and password of the account")
    # A refusal for good is the mail's only when the server has seen something of the mail: sender, recipients, content.
    mail = isinstance(error, smtplib.SMTPSenderRefused | smtplib.SMTPDataError)
    leaf = Refused if mail and error.smtp_code >= 500 else Unreachable
    return leaf(f"cannot send by {where}: {words}")
