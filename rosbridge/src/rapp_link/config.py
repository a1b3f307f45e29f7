"""Settings of the link: one frozen object, from environment and options; the mail password is read where it is used."""

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import platformdirs


@dataclass(frozen=True)
class SmtpConfig:
    """The mail account."""

    host: str = "127.0.0.1"
    port: int = 25
    user: str = ""  # empty: no AUTH
    password: str = ""
    security: str = "starttls"  # none, starttls, tls
    sender: str = ""
    certificates: Path | None = None  # PEM file of extra certificate authorities
    timeout: float = 20.0  # s per step of the protocol

    def __repr__(self) -> str:
        """Without the password: configurations end up in logs."""
        return f"SmtpConfig({self.user or 'nobody'} at {self.host}:{self.port}, {self.security})"


@dataclass(frozen=True)
class Config:
    """Every setting of the link."""

    bridge: str = "ws://127.0.0.1:9090"
    cloud: str = "http://127.0.0.1:9001"
    home: Path = Path(platformdirs.user_data_dir("rapp"))
    token_file: Path | None = None
    root_file: Path | None = None  # trusted root of the store (TUF), shipped with the robot
    smtp: SmtpConfig = SmtpConfig()
    alive_period: float = 0.25  # s between signs of life
    jobs: int = 32  # open at once
    heartbeat_period: float = 10.0  # s between heartbeats to the platform
    retry_first: float = 2.0  # s until a kept mail or report is tried again; doubles
    retry_most: float = 300.0  # s


def read(words: Sequence[str], env: Mapping[str, str] = os.environ) -> Config:
    """Read options over environment over defaults."""
    parser = argparse.ArgumentParser(prog="link", description="the robot's HOP program")
    for name, variable, text in _OPTIONS:
        parser.add_argument(f"--{name}", default=env.get(variable), help=f"{text} [{variable}]")
    got = {name.replace("-", "_"): value for name, value in vars(parser.parse_args(words)).items()}
    default = Config()
    return Config(
        bridge=got["bridge"] or default.bridge,
        cloud=(got["cloud"] or default.cloud).rstrip("/"),
        home=Path(got["home"] or default.home).expanduser().resolve(),
        token_file=_path(got["token_file"]),
        root_file=_path(got["root_file"]),
        smtp=SmtpConfig(
            host=got["smtp_host"] or SmtpConfig.host,
            port=int(got["smtp_port"] or SmtpConfig.port),
            user=got["smtp_user"] or "",
            password=_password(_path(got["smtp_password_file"]), env),
            security=got["smtp_security"] or SmtpConfig.security,
            sender=got["mail_from"] or got["smtp_user"] or "",
            certificates=_path(got["smtp_certificates"]),
        ),
    )


_OPTIONS = (
    ("bridge", "RAPP_BRIDGE", "URL of rosbridge"),
    ("cloud", "RAPP_CLOUD", "URL of the platform"),
    ("home", "RAPP_HOME", "the robot's data folder"),
    ("token-file", "RAPP_TOKEN_FILE", "file that holds this robot's token"),
    ("root-file", "RAPP_ROOT_FILE", "trusted root of the store"),
    ("smtp-host", "RAPP_SMTP_HOST", "mail server"),
    ("smtp-port", "RAPP_SMTP_PORT", "its port"),
    ("smtp-user", "RAPP_SMTP_USER", "its user; empty: no login"),
    ("smtp-password-file", "RAPP_SMTP_PASSWORD_FILE", "file that holds the password; or RAPP_SMTP_PASSWORD"),
    ("smtp-security", "RAPP_SMTP_SECURITY", "none, starttls or tls"),
    ("smtp-certificates", "RAPP_SMTP_CERTIFICATES", "PEM file of certificate authorities to trust as well"),
    ("mail-from", "RAPP_MAIL_FROM", "the sender's address"),
)


def _path(value: str | None) -> Path | None:
    return Path(value).expanduser() if value else None


def _password(file: Path | None, env: Mapping[str, str]) -> str:
    return file.read_text().strip() if file is not None else env.get("RAPP_SMTP_PASSWORD", "")
