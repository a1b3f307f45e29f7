"""The real mail account that the robot sends from: its options and environment."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rapp_cli.errors import UsageError


@dataclass(frozen=True)
class MailAccount:
    """The real mail account to send with; its password never passes through here."""

    host: str
    port: int
    user: str
    security: str  # none, starttls or tls
    password_file: Path | None
    sender: str


def add_options(parser: "argparse._ArgumentGroup") -> None:
    """Options of a mail account, each with its environment variable."""
    parser.add_argument("--smtp-host", help="a real mail account's server [RAPP_SMTP_HOST]")
    parser.add_argument("--smtp-port", type=int, help="its port (587) [RAPP_SMTP_PORT]")
    parser.add_argument("--smtp-user", help="its user [RAPP_SMTP_USER]; the password by RAPP_SMTP_PASSWORD or the file")
    parser.add_argument("--smtp-security", choices=("starttls", "tls", "none"), help="(starttls) [RAPP_SMTP_SECURITY]")
    parser.add_argument("--smtp-password-file", type=Path, help="file that holds the password [RAPP_SMTP_PASSWORD_FILE]")
    parser.add_argument("--mail-from", metavar="ADDRESS", help="the sender's address [RAPP_MAIL_FROM]")


def read(options: argparse.Namespace, env: Mapping[str, str]) -> MailAccount | None:
    """The account that options and environment name; None without a server. Raises UsageError."""
    host = options.smtp_host or env.get("RAPP_SMTP_HOST")
    if not host:
        return None
    password_file = options.smtp_password_file or env.get("RAPP_SMTP_PASSWORD_FILE")
    user = options.smtp_user or env.get("RAPP_SMTP_USER", "")
    try:
        port = options.smtp_port or int(env.get("RAPP_SMTP_PORT") or "587")
    except ValueError:
        raise UsageError("cannot use RAPP_SMTP_PORT: it must be a number, such as 587") from None
    return MailAccount(
        host=host,
        port=port,
        user=user,
        security=options.smtp_security or env.get("RAPP_SMTP_SECURITY", "starttls"),
        password_file=Path(password_file).absolute() if password_file else None,
        sender=options.mail_from or env.get("RAPP_MAIL_FROM", user),
    )
