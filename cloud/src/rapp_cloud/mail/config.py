"""Settings of the mail server: one frozen object, from options."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class MailConfig:
    """Every setting."""

    maildir: Path
    address: str = "127.0.0.1"
    port: int = 2525  # 0: any free one
    certificate: Path | None = None  # PEM; with it STARTTLS is offered and required
    key: Path | None = None  # PEM
    users_file: Path | None = None  # JSON object of names and passwords; with it AUTH is required
    size_limit: int = 32 << 20  # bytes of one mail
    idle_timeout: float = 60.0  # s


def read(words: Sequence[str]) -> MailConfig:
    """Read the options."""
    parser = argparse.ArgumentParser(prog="rapp-mail", description="SMTP server that delivers into a Maildir")
    parser.add_argument("--maildir", type=Path, required=True)
    parser.add_argument("--address", default=MailConfig.address, help="where to listen (%(default)s)")
    parser.add_argument("--port", type=int, default=MailConfig.port, help="0: any free one (%(default)s)")
    parser.add_argument("--certificate", type=Path, help="PEM file: offer and require STARTTLS")
    parser.add_argument("--key", type=Path, help="PEM file of the certificate's key")
    parser.add_argument("--users-file", type=Path, help="JSON object of names and passwords: require AUTH")
    return MailConfig(**vars(parser.parse_args(words)))
