"""The table of the agents that `up` keeps running: their processes, in the order in which they start, and their environment."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass

from rapp_cli.cloud import foreign_cloud, link_environment, own_cloud
from rapp_cli.home.place import Home, Settings
from rapp_cli.mail_account import MailAccount
from rapp_cli.secrecy import CLOUD, LINK

NOT_OURS = ("ROS_NAMESPACE", "ROS_HOSTNAME")  # of the user's own ROS; they would move our names and addresses
CORE = "core_agent"
RECORDER = "recorder"


@dataclass(frozen=True)
class Agent:
    """One process; it says READY on its log when it serves, unless `port` is what tells."""

    name: str
    words: tuple[str, ...]
    port: int | None = None


def agents(home: Home, settings: Settings) -> list[Agent]:
    """All processes of a home. Each waits for those it needs, so any of them may be started again at any time."""
    ports, robot = settings.ports, str(home.robot)
    table = [Agent("roscore", ("rosmaster", "--core", "-p", str(ports["roscore"])), ports["roscore"])]
    if settings.mail is None:
        table.append(_module("mail", "rapp_cloud.mail", "--port", str(ports["mail"]), "--maildir", str(home.maildir)))
    if settings.cloud is None:
        table.append(_module(CLOUD, "rapp_cloud", "--port", str(ports["cloud"]), "--data", str(home.cloud)))
    if settings.robot is None:
        words = ("--port", str(ports["nao_sim"]), "--files", robot, *settings.simulator)
        table.append(_module("nao_sim", "rapp_nao_sim", *words))
    return [
        *table,
        _module("rosbridge", "rapp_bridge", "--port", str(ports["rosbridge"])),
        _module(RECORDER, "rapp_cli.home.recorder", "--bridge", settings.bridge, "--file", str(home.timeline)),
        _module(LINK, "rapp_link", "--bridge", settings.bridge, "--home", robot),
        _module(CORE, "rapp_core", "--robot", settings.naoqi, "--home", robot, "--name", settings.name),
    ]


def environment(home: Home, settings: Settings, env: Mapping[str, str]) -> dict[str, str]:
    """The environment of all of them. Raises UsageError when a foreign platform is not fully known."""
    if settings.cloud is None:
        cloud = own_cloud(home.cloud, settings.ports["cloud"], settings.name)
    else:
        cloud = foreign_cloud(settings.cloud, {**_joined(home), **env})
    account = settings.mail
    if account is None:
        account = MailAccount("127.0.0.1", settings.ports["mail"], "", "none", None, f"{settings.name}@home.example")
    return {
        **{name: value for name, value in env.items() if name not in NOT_OURS},
        "ROS_MASTER_URI": settings.master,
        "ROS_IP": "127.0.0.1",
        "ROS_LOG_DIR": str(home.logs / "ros"),
        "RAPP_HOME": str(home.robot),
        "RAPP_ROBOT_NAME": settings.name,
        **link_environment(cloud, account),
    }


def _joined(home: Home) -> dict[str, str]:
    files = {"RAPP_TOKEN_FILE": home.joined / "token", "RAPP_ROOT_FILE": home.joined / "root.json"}
    return {name: str(file) for name, file in files.items() if file.exists()}


def _module(name: str, module: str, *words: str) -> Agent:
    return Agent(name, (sys.executable, "-m", module, *words))
