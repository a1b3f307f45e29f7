"""The sending half of SMTP: one mail to one account, with STARTTLS or TLS and login; errors translated once."""

import smtplib
import ssl
from collections.abc import Sequence

from rapp_link.config import SmtpConfig
from rapp_link.errors import Invalid, Refused, Unreachable


def send(account: SmtpConfig, recipients: Sequence[str], content: bytes) -> None:
    """Send one mail; returns once the server has accepted it.

    Raises Refused when the server does not want it (5xx, login, certificate), Unreachable when it is worth trying again.
    """
    try:
        with _connect(account) as server:
            if account.security == "starttls":
                server.starttls(context=_tls(account))
            if account.user:
                server.login(account.user, account.password)
            refused = server.sendmail(account.sender, list(recipients), content)
    except smtplib.SMTPAuthenticationError as error:
        raise Refused(f"cannot log in at {account.host} as {account.user}: {_words(error)}; check user and password") from error
    except smtplib.SMTPRecipientsRefused as error:
        code, words = next(iter(error.recipients.values()))
        _raise(code, f"cannot send: {account.host} refused the recipient: {words.decode(errors='replace')}", error)
    except smtplib.SMTPResponseException as error:
        _raise(error.smtp_code, f"cannot send: {account.host} answered {_words(error)}", error)
    except smtplib.SMTPNotSupportedError as error:
        raise Refused(f"cannot send by {account.host}: {error}; choose another --smtp-security") from error
    except ssl.SSLError as error:
        raise Refused(f"cannot trust {account.host}: {error}; check the host's name and certificate") from error
    except (smtplib.SMTPException, OSError) as error:
        raise Unreachable(f"cannot reach the mail server {account.host}:{account.port}: {error}") from error
    if refused:
        raise Refused(f"cannot send to {', '.join(refused)}: {account.host} refused them; the others were sent to")


def _connect(account: SmtpConfig) -> smtplib.SMTP:
    if account.security == "tls":
        return smtplib.SMTP_SSL(account.host, account.port, timeout=account.timeout, context=_tls(account))
    if account.security not in ("starttls", "none"):
        raise Invalid(f"cannot send: --smtp-security {account.security} is not none, starttls or tls")
    if account.security == "none" and account.user:
        raise Invalid("cannot send: a password is never sent without encryption; use --smtp-security starttls or tls")
    return smtplib.SMTP(account.host, account.port, timeout=account.timeout)


def _tls(account: SmtpConfig) -> ssl.SSLContext:
    context = ssl.create_default_context()
    if account.certificates is not None:
        context.load_verify_locations(account.certificates)
    return context


def _words(error: smtplib.SMTPResponseException) -> str:
    words = error.smtp_error
    return f"{error.smtp_code} {words.decode(errors='replace') if isinstance(words, bytes) else words}"


def _raise(code: int, text: str, error: Exception) -> None:
    kind = Refused if code >= 500 else Unreachable
    raise kind(text) from error
