"""A platform for a robot: making one, or using one that runs already; what the robot's link is told of it."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from rapp_cli.errors import CommandError, UsageError
from rapp_cli.mail_account import MailAccount
from rapp_cli.paths import STORE
from rapp_cli.secrecy import CLOUD, confided
from rapp_cloud.profiles import sound_of

LOOPBACK = ("127.0.0.1", "::1", "localhost")  # where HTTP without encryption is allowed
USER = "Maria"  # whom the robot serves
CONTACTS = {
    "Doctor Nowak": "nowak@clinic.example",
    "Margaret": "margaret@home.example",
}
"""People the user writes to, by name."""


@dataclass(frozen=True)
class Cloud:
    """A platform, and what a robot needs to be its robot."""

    url: str
    token_file: Path
    root_file: Path
    ca_file: Path | None = None  # certificate of a platform of one's own; None: the system's authorities


def own_cloud(data: Path, port: int, robot: str) -> Cloud:
    """The platform on this computer whose data lie in a folder."""
    return Cloud(f"http://127.0.0.1:{port}", data / "robots" / f"{robot}.token", data / "root.json")


def foreign_cloud(url: str, env: Mapping[str, str]) -> Cloud:
    """A platform that runs already; raises UsageError when its address or what it gave this robot is missing."""
    check_url(url)
    ca_file = Path(env["RAPP_CLOUD_CA_FILE"]).absolute() if env.get("RAPP_CLOUD_CA_FILE") else None
    try:
        return Cloud(url, Path(env["RAPP_TOKEN_FILE"]).absolute(), Path(env["RAPP_ROOT_FILE"]).absolute(), ca_file)
    except KeyError as error:
        raise UsageError(f"cannot use {url} without {error}: ./rapp join, or set it to the file the platform gave") from None


def check_url(url: str) -> str:
    """Return a platform's URL; raises UsageError when it is none, or would send a token in the clear."""
    parts = urlsplit(url)
    if parts.scheme != "https" and (parts.scheme != "http" or parts.hostname not in LOOPBACK):
        raise UsageError(f"cannot use {url!r} as a platform: give a URL such as https://rapp.example:9001")
    return url


def make_platform(data: Path, robot: str) -> None:
    """Make keys, a store and the robot's token, unless they are there. Raises CommandError."""
    words = [sys.executable, "-m", "rapp_cloud", "init", "--data", str(data), "--robot", robot]
    made = subprocess.run(words, env=confided(os.environ, CLOUD), capture_output=True, text=True, timeout=60, check=False)
    if made.returncode:
        raise CommandError(f"cannot make the platform's keys in {data}: {made.stderr.strip()}")


def contacts_with(name: str, address: str) -> dict[str, str]:
    """The user's contacts and one more, who takes the place of one whose name sounds the same."""
    others = {known: known_address for known, known_address in CONTACTS.items() if sound_of(known) != sound_of(name)}
    return {name: address, **others}


def write_profile(data: Path, robot: str, contacts: Mapping[str, str]) -> None:
    """Write down the robot's user for the platform to take over: who they are, whom they write to (name to mail address)."""
    listed = [{"name": name, "address": address} for name, address in contacts.items()]
    path = data / "profiles" / f"{robot}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"name": USER, "language": "en", "contacts": listed}, indent=2))


def own_rapps() -> list[Path]:
    """Sources of the packages that come with the repository; a four-agent RApp has two."""
    return sorted(file.parent for pattern in ("*/package.json", "*/*/package.json") for file in STORE.glob(pattern))


def link_environment(cloud: Cloud, account: MailAccount) -> dict[str, str]:
    """What the robot's link is told by its environment; the mail password is not among it."""
    values = {
        "RAPP_CLOUD": cloud.url,
        "RAPP_TOKEN_FILE": str(cloud.token_file),
        "RAPP_ROOT_FILE": str(cloud.root_file),
        "RAPP_CLOUD_CA_FILE": str(cloud.ca_file or ""),
        "RAPP_SMTP_HOST": account.host,
        "RAPP_SMTP_PORT": str(account.port),
        "RAPP_SMTP_USER": account.user,
        "RAPP_SMTP_SECURITY": account.security,
        "RAPP_MAIL_FROM": account.sender,
    }
    if account.password_file is not None:
        values["RAPP_SMTP_PASSWORD_FILE"] = str(account.password_file)
    return values
