"""SMTP by aiosmtpd: what is accepted, from whom, and the answers."""

import hmac
import json
import logging
from email.utils import parseaddr
from pathlib import Path
from ssl import Purpose, SSLContext, create_default_context
from typing import Any

from aiosmtpd.smtp import SMTP, AuthResult, Envelope, LoginPassword, Session

from rapp_cloud.mail.config import MailConfig
from rapp_cloud.mail.maildir import Maildir

_log = logging.getLogger(__name__)


class Handler:
    """Answers of the server to RCPT and DATA."""

    def __init__(self, maildir: Maildir) -> None:
        self._maildir = maildir

    async def handle_RCPT(  # noqa: N802 - aiosmtpd's name
        self, _server: SMTP, _session: Session, envelope: Envelope, address: str, _options: list[str]
    ) -> str:
        """Accept addresses of the form name@domain."""
        name, _, domain = parseaddr(address)[1].partition("@")
        if not name or not domain:
            return "550 5.1.3 that is no mail address"
        envelope.rcpt_tos.append(address)
        return "250 2.1.5 accepted"

    async def handle_DATA(self, _server: SMTP, _session: Session, envelope: Envelope) -> str:  # noqa: N802
        """Deliver; what cannot be written now may be sent again."""
        content = envelope.content
        assert isinstance(content, bytes)
        try:
            path = self._maildir.deliver(content)
        except OSError:
            _log.exception("a mail could not be written")
            return "451 4.3.0 cannot write the mail; send it again later"
        _log.info("delivered %s", path or "nothing: that Message-ID was delivered before")
        return "250 2.0.0 delivered"


class Users:
    """Names and passwords from a JSON file, for AUTH."""

    def __init__(self, file: Path) -> None:
        self._users: dict[str, str] = json.loads(file.read_text())

    def check(self, _server: SMTP, _session: Session, _envelope: Envelope, _mechanism: str, data: Any) -> AuthResult:
        """See aiosmtpd's authenticator."""
        if not isinstance(data, LoginPassword):
            return AuthResult(success=False, handled=False)
        known = self._users.get(data.login.decode(errors="replace"), "")
        good = bool(known) and hmac.compare_digest(known.encode(), data.password)
        return AuthResult(success=good, handled=False)


def make_smtp(config: MailConfig, maildir: Maildir) -> SMTP:
    """The protocol object of one connection."""
    options: dict[str, Any] = {}
    if config.certificate is not None:
        options |= {"tls_context": _tls(config), "require_starttls": True}
    if config.users_file is not None:
        authenticator = Users(config.users_file).check
        options |= {"authenticator": authenticator, "auth_required": True, "auth_require_tls": config.certificate is not None}
    limit = {"data_size_limit": config.size_limit, "timeout": config.idle_timeout}
    return SMTP(Handler(maildir), hostname="rapp-mail", ident="RAPP mail", enable_SMTPUTF8=True, **limit, **options)


def _tls(config: MailConfig) -> SSLContext:
    assert config.certificate is not None
    context = create_default_context(Purpose.CLIENT_AUTH)
    context.load_cert_chain(config.certificate, config.key)
    return context
