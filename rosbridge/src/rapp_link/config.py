"""Settings of the link: one frozen object, from environment and options."""

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

from rapp_hop.errors import Invalid, Refused
from rapp_link.addresses import check_address

LOOPBACK = ("127.0.0.1", "::1", "localhost")
SECURITY = ("none", "starttls", "tls")


@dataclass(frozen=True)
class MailConfig:
    """The mail account that the robot sends from."""

    host: str = ""  # empty: the robot sends no mail
    port: int = 587
    user: str = ""  # empty: no AUTH
    password: str = field(default="", repr=False)
    security: str = "starttls"  # none, starttls or tls
    ca_file: Path | None = None  # PEM; none: the system's authorities
    sender: str = ""  # address in MAIL FROM and From
    connect_timeout: float = 10.0  # seconds, also for each answer of the server
    transfer_timeout: float = 60.0  # seconds for one whole try
    retry_first: float = 2.0  # seconds to the second try
    retry_most: float = 300.0  # seconds between later tries
    give_up: float = 5 * 86400.0  # seconds (RFC 5321 §4.5.4.1)
    attachment: int = 25 * 2**20  # bytes
    waiting: int = 200  # mails that may wait in the outbox


@dataclass(frozen=True)
class Config:
    """Everything the link is told."""

    home: Path
    bridge: str = "ws://127.0.0.1:9090"
    cloud: str = "http://127.0.0.1:9001"  # https beyond loopback
    cloud_ca_file: Path | None = None  # PEM; none: the system's authorities
    token: str = field(default="", repr=False)
    root: bytes = field(default=b"", repr=False)  # trusted root.json of the store
    quota: int = 2**30  # bytes of all installed RApps and their downloads; 0: no bound
    mail: MailConfig = field(default_factory=MailConfig)
    jobs: int = 32  # open at once
    longest: float = 600.0  # seconds a job may take
    alive: float = 0.25  # seconds between signs of life
    heartbeat_most: float = 5.0  # seconds between heartbeats to the platform; a third of the lease when that is less
    retry_first: float = 0.5  # seconds to the next try when the platform is away
    retry_most: float = 15.0  # seconds


def read(words: Sequence[str], env: Mapping[str, str] = os.environ) -> Config:
    """Read options, over environment (RAPP_*), over defaults.

    :raises Invalid: a setting or one of the files it names is wrong
    """
    options = _parser(env).parse_args(words)
    home = Path(options.home).expanduser().absolute()
    return Config(
        home=home,
        bridge=options.bridge,
        cloud=_cloud(options.cloud),
        cloud_ca_file=Path(options.cloud_ca_file) if options.cloud_ca_file else None,
        token=_text(options.token_file, "token file"),
        root=_bytes(options.root_file, "trusted root"),
        quota=_count(options.quota, "quota", "bytes"),
        mail=_mail(options, env),
    )


def _parser(env: Mapping[str, str]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="link", description="The robot's way to platform and mail server")
    data = Path(env.get("XDG_DATA_HOME") or Path("~/.local/share").expanduser())

    def option(name: str, default: object, text: str) -> None:
        known = env.get("RAPP_" + name.upper().replace("-", "_"))
        parser.add_argument(f"--{name}", default=known or default, help=f"{text} (RAPP_{name.upper().replace('-', '_')})")

    option("bridge", Config.bridge, "rosbridge")
    option("cloud", Config.cloud, "platform")
    option("cloud-ca-file", "", "certificate (PEM) of a platform of your own")
    option("home", data / "rapp", "the robot's data folder")
    option("token-file", "", "file with the robot's token for the platform")
    option("root-file", "", "trusted root.json of the platform's store")
    option("quota", Config.quota, "bytes that installed RApps may take of the disk; 0: no bound")
    option("smtp-host", "", "mail server; none: no mails are sent")
    option("smtp-port", MailConfig.port, "its port")
    option("smtp-user", "", "name of the account; none: no login")
    option("smtp-security", MailConfig.security, "none, starttls or tls")
    option("smtp-password-file", "", "file with the password; or the variable RAPP_SMTP_PASSWORD")
    option("smtp-ca-file", "", "certificate authority (PEM) of a mail server of your own")
    option("mail-from", "", "sender's address; none: the account's name")
    return parser


def _cloud(url: str) -> str:
    """Refuse to send the token in the clear to another computer."""
    parts = urlsplit(url)
    if parts.scheme == "http" and parts.hostname not in LOOPBACK:
        raise Invalid(f"cannot use --cloud {url!r} without encryption: give an https:// address")
    return url


def _mail(options: argparse.Namespace, env: Mapping[str, str]) -> MailConfig:
    if not options.smtp_host:
        return MailConfig()
    if options.smtp_security not in SECURITY:
        raise Invalid(f"cannot use --smtp-security {options.smtp_security!r}: give one of {', '.join(SECURITY)}")
    if options.smtp_user and options.smtp_security == "none" and options.smtp_host not in LOOPBACK:
        raise Invalid("cannot log in without encryption: use --smtp-security starttls or tls")
    try:
        port = int(options.smtp_port)
        sender = check_address(options.mail_from or options.smtp_user)
    except ValueError:
        raise Invalid(f"cannot use --smtp-port {options.smtp_port!r}: give a number") from None
    except Refused as error:
        raise Invalid(f"cannot send from --mail-from {options.mail_from!r}: {error}") from None
    return MailConfig(
        host=options.smtp_host,
        port=port,
        user=options.smtp_user,
        password=_text(options.smtp_password_file, "password file") or env.get("RAPP_SMTP_PASSWORD", ""),
        security=options.smtp_security,
        ca_file=Path(options.smtp_ca_file) if options.smtp_ca_file else None,
        sender=sender,
    )


def _count(text: object, name: str, unit: str) -> int:
    if not str(text).isdecimal():
        raise Invalid(f"cannot use --{name} {text!r}: give a number of {unit}")
    return int(str(text))


def _text(path: str, what: str) -> str:
    try:
        return _bytes(path, what).decode().strip()
    except UnicodeDecodeError:
        raise Invalid(f"cannot read the {what} {path}: it is not text") from None


def _bytes(path: str, what: str) -> bytes:
    if not path:
        return b""
    try:
        return Path(path).expanduser().read_bytes()
    except OSError as error:
        raise Invalid(f"cannot read the {what} {path}: {error.strerror}, check the option") from None
