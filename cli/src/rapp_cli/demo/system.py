"""The processes of the demo: mail server, cloud, robot; on ports and in folders of their own, so that two can run."""

import os
import sys
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from rapp_cli.cloud import (
    Cloud,
    contacts_with,
    foreign_cloud,
    link_environment,
    make_platform,
    own_cloud,
    own_rapps,
    write_profile,
)
from rapp_cli.demo.config import DemoConfig
from rapp_cli.mail_account import MailAccount
from rapp_cli.paths import ROBOT_SCRIPTS
from rapp_cli.processes import Child, Children
from rapp_cli.secrecy import CLOUD, LINK, confided

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
    cloud: Cloud


@asynccontextmanager
async def running_system(config: DemoConfig, rapps: Sequence[Path] | None = None) -> AsyncIterator[System]:
    """Start everything the demo needs, in order; end it in reverse order, whatever happened.

    :param rapps: sources of the packages on offer; None: those that come with the repository
    """
    logs = config.folder / "logs"
    maildir = config.folder / "mail"
    async with Children() as children:
        account = config.mail or await _mail_server(children, maildir, logs)
        cloud = await _cloud(config, own_rapps() if rapps is None else rapps, children, logs)
        words = [str(ROBOT_SCRIPTS / "robot"), "--home", str(config.folder / "robot"), "--name", ROBOT_NAME]
        if config.robot:
            words += ["--robot", config.robot]
        if config.language != "en":
            settings = config.folder / "core_agent.toml"
            settings.write_text(f'language = "{config.language}"\n')
            words += ["--config", str(settings)]
        if config.silent:
            words += ["--microphone", "text", "--voice", "silent"]
        env = {**confided(os.environ, LINK), **link_environment(cloud, account)}
        ready = await children.start(Child("robot", words, env, logs / "robot.log"))
        yield System(children, ready["bridge"], ready["robot"], ready["master"], maildir, logs, cloud)


async def _mail_server(children: Children, maildir: Path, logs: Path) -> MailAccount:
    words = [sys.executable, "-m", "rapp_cloud.mail", "--port", "0", "--maildir", str(maildir)]
    ready = await children.start(Child("mail server", words, confided(os.environ, "mail"), logs / "mail.log"))
    return MailAccount("127.0.0.1", int(ready["port"]), "", "none", None, f"{ROBOT_NAME}@home.example")


async def _cloud(config: DemoConfig, sources: Sequence[Path], children: Children, logs: Path) -> Cloud:
    if config.cloud:
        return foreign_cloud(config.cloud, os.environ)
    data = config.folder / "cloud"
    make_platform(data, ROBOT_NAME)
    write_profile(data, ROBOT_NAME, contacts_with(config.recipient, config.address))
    rapps = [word for folder in sources for word in ("--publish", str(folder))]
    words = [sys.executable, "-m", "rapp_cloud", "--port", "0", "--data", str(data), *rapps]
    ready = await children.start(Child("cloud", words, confided(os.environ, CLOUD), logs / "cloud.log"))
    return own_cloud(data, int(ready["port"]), ROBOT_NAME)
