"""Settings of the mail server: one frozen object, from environment and options."""

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Limits:
    """Bounds of what one client may ask for."""

    message: int = 32 * 2**20  # bytes of one message
    recipients: int = 100  # of one message
    sessions: int = 64  # connections at once; the next is told to come back
    idle: float = 60.0  # seconds a client may be silent
    remembered: int = 100_000  # deliveries kept in mind


@dataclass(frozen=True)
class Config:
    """Everything the server is told."""

    maildir: Path
    address: str = "127.0.0.1"
    port: int = 2525  # 0: any free one
    certificate: Path | None = None  # PEM chain; with the key it turns STARTTLS on
    key: Path | None = None
    users_file: Path | None = None  # turns AUTH on, and demands it
    domains: tuple[str, ...] = ()  # recipients' domains served; none: every one
    add_user: str = ""  # name to write to the users file instead of serving
    limits: Limits = field(default_factory=Limits)


def read(words: Sequence[str], env: Mapping[str, str] = os.environ) -> Config:
    """Read options, over environment (RAPP_MAIL_PORT), over defaults; ends the process when they are wrong."""
    parser = argparse.ArgumentParser(prog="rapp-mail", description="SMTP server that writes a Maildir")
    parser.add_argument("--maildir", type=Path, help="folder to deliver into; made when missing")
    parser.add_argument("--address", default=Config.address, help="where to listen (%(default)s)")
    parser.add_argument("--port", type=int, default=int(env.get("RAPP_MAIL_PORT", Config.port)), help="0: any free one")
    parser.add_argument("--cert", type=Path, help="certificate chain (PEM): offers STARTTLS")
    parser.add_argument("--key", type=Path, help="its private key (PEM)")
    parser.add_argument("--users-file", type=Path, help="demands AUTH of one of these users")
    parser.add_argument("--domain", action="append", default=[], help="serve this domain's recipients only; repeatable")
    parser.add_argument("--add-user", default="", metavar="NAME", help="add to the users file, password from stdin, and end")
    options = parser.parse_args(words)
    _check(parser, options)
    return Config(
        options.maildir or Path(),
        options.address,
        options.port,
        options.cert,
        options.key,
        options.users_file,
        tuple(name.lower() for name in options.domain),
        options.add_user,
    )


def _check(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    if options.add_user:
        if options.users_file is None:
            parser.error("cannot add a user without --users-file")
        return
    if options.maildir is None:
        parser.error("cannot serve without --maildir DIR")
    if (options.cert is None) != (options.key is None):
        parser.error("cannot offer STARTTLS with one of --cert and --key: give both")
    if options.users_file is not None and options.cert is None:
        parser.error("cannot demand AUTH without STARTTLS: give --cert and --key too")
