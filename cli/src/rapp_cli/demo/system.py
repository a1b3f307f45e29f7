"""The processes of the demo: mail server, cloud, robot; on ports and in folders of their own, so that two can run."""

import json
import os
import subprocess
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from rapp_cli.demo.config import DemoConfig, MailAccount
from rapp_cli.errors import CommandError, UsageError
from rapp_cli.paths import ROBOT_SCRIPTS, STORE
from rapp_cli.processes import Child, Children

ROBOT_NAME = "nao"


@dataclass(frozen=True)
class System:
    """What the running processes offer."""

    children: Children
    bridge: str  # ws URL of the rosbridge
    robot: str  # URL of the robot's NAOqi
    master: str  # URI of the ROS master
    maildir: Path
    logs: Path


@dataclass(frozen=True)
class _Cloud:
    """A platform, and what a robot needs to be its robot."""

    url: str
    token_file: Path
    root_file: Path


@asynccontextmanager
async def running_system(config: DemoConfig) -> AsyncIterator[System]:
    """Start everything the demo needs, in order; end it in reverse order, whatever happened."""
    logs = config.folder / "logs"
    maildir = config.folder / "mail"
    async with Children() as children:
        account = config.mail or await _mail_server(children, maildir, logs)
        cloud = await _cloud(config, children, logs)
        words = [str(ROBOT_SCRIPTS / "robot"), "--home", str(config.folder / "robot"), "--name", ROBOT_NAME]
        if config.robot:
            words += ["--robot", config.robot]
        env = {**os.environ, **_link_environment(cloud, account)}
        ready = await children.start(Child("robot", words, env, logs / "robot.log"))
        yield System(children, ready["bridge"], ready["robot"], ready["master"], maildir, logs)


async def _mail_server(children: Children, maildir: Path, logs: Path) -> MailAccount:
    words = [sys.executable, "-m", "rapp_cloud.mail", "--port", "0", "--maildir", str(maildir)]
    ready = await children.start(Child("mail server", words, os.environ, logs / "mail.log"))
    return MailAccount("127.0.0.1", int(ready["port"]), "", "none", None, f"{ROBOT_NAME}@home.example")


async def _cloud(config: DemoConfig, children: Children, logs: Path) -> _Cloud:
    if config.cloud:
        return _foreign_cloud(config.cloud)
    data = config.folder / "cloud"
    _make_platform(data)
    _write_profile(data, config)
    rapps = [word for folder in sorted(STORE.iterdir()) if folder.is_dir() for word in ("--publish", str(folder))]
    words = [sys.executable, "-m", "rapp_cloud", "--port", "0", "--data", str(data), *rapps]
    ready = await children.start(Child("cloud", words, os.environ, logs / "cloud.log"))
    return _Cloud(f"http://127.0.0.1:{ready['port']}", data / "robots" / f"{ROBOT_NAME}.token", data / "root.json")


def _foreign_cloud(url: str) -> _Cloud:
    if urlsplit(url).scheme not in ("http", "https"):
        raise UsageError(f"cannot use {url!r} as a platform: give a URL such as https://rapp.example:9001")
    try:
        return _Cloud(url, Path(os.environ["RAPP_TOKEN_FILE"]), Path(os.environ["RAPP_ROOT_FILE"]))
    except KeyError as error:
        raise UsageError(f"cannot use {url} without {error}: set it to the file the platform gave this robot") from None


def _make_platform(data: Path) -> None:
    words = [sys.executable, "-m", "rapp_cloud", "init", "--data", str(data), "--robot", ROBOT_NAME]
    made = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    if made.returncode:
        raise CommandError(f"cannot make the platform's keys in {data}: {made.stderr.strip()}")


def _write_profile(data: Path, config: DemoConfig) -> None:
    contacts = [
        {"name": config.recipient, "address": config.address},
        {"name": "Doctor Nowak", "address": "nowak@clinic.example"},
        {"name": "Margaret", "address": "margaret@home.example"},
    ]
    profile = {"name": "Maria", "language": "en", "contacts": contacts}
    (data / "profiles").mkdir(parents=True, exist_ok=True)
    (data / "profiles" / f"{ROBOT_NAME}.json").write_text(json.dumps(profile, indent=2))


def _link_environment(cloud: _Cloud, account: MailAccount) -> dict[str, str]:
    values = {
        "RAPP_CLOUD": cloud.url,
        "RAPP_TOKEN_FILE": str(cloud.token_file),
        "RAPP_ROOT_FILE": str(cloud.root_file),
        "RAPP_SMTP_HOST": account.host,
        "RAPP_SMTP_PORT": str(account.port),
        "RAPP_SMTP_USER": account.user,
        "RAPP_SMTP_SECURITY": account.security,
        "RAPP_MAIL_FROM": account.sender,
    }
    if account.password_file is not None:
        values["RAPP_SMTP_PASSWORD_FILE"] = str(account.password_file)
    return values
