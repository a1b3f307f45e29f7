"""The agents of a home, and the supervisor's configuration for them, read by the supervisor itself."""

import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from supervisor.options import ServerOptions

from rapp_cli.errors import UsageError
from rapp_cli.home.agents import Agent, agents, environment
from rapp_cli.home.place import Home, Settings
from rapp_cli.home.supervisor import configuration

PORTS = {"roscore": 11311, "nao_sim": 9559, "rosbridge": 9090, "cloud": 9001, "mail": 2525}
SIMULATED = Settings("nao", None, None, None, (), PORTS)
HOME = Home(Path("/var/a home"))


def programs(tmp_path: Path, table: list[Agent]) -> dict[str, Any]:
    """What supervisord makes of the configuration, by name."""
    file = tmp_path / "supervisor" / "supervisord.conf"
    file.parent.mkdir()
    (tmp_path / "logs").mkdir()
    file.write_text(configuration(table))
    options = ServerOptions()
    options.realize(["-c", str(file)])
    return {config.name: config for group in options.process_group_configs for config in group.process_configs}


def test_supervisord_starts_the_agents_in_order_and_keeps_them_running(tmp_path: Path) -> None:
    table = agents(HOME, SIMULATED)
    found = programs(tmp_path, table)
    assert sorted(found, key=lambda name: found[name].priority) == [agent.name for agent in table]
    assert all(config.autorestart and config.killasgroup and not config.stopasgroup for config in found.values())
    assert found["link"].stdout_logfile == str(tmp_path / "supervisor" / ".." / "logs" / "link.log")


def test_words_reach_an_agent_as_they_are(tmp_path: Path) -> None:
    words = ("python", "-m", "x", "--home", "/a b/100%/it's")
    found = programs(tmp_path, [Agent("x", words)])
    assert shlex.split(found["x"].command) == ["setpriv", "--pdeathsig", "TERM", *words]


@pytest.mark.parametrize(
    ("secret", "owner"), [("RAPP_SMTP_PASSWORD", "link"), ("RAPP_CLOUD_PASSPHRASE", "cloud"), ("RAPP_CLOUD_DATABASE", "cloud")]
)
def test_a_secret_reaches_its_agent_alone(tmp_path: Path, secret: str, owner: str) -> None:
    found = programs(tmp_path, agents(HOME, SIMULATED))
    told: Mapping[str, str] = {name: config.environment.get(secret) for name, config in found.items()}
    assert told.pop(owner) is None  # what the supervisor itself has
    assert set(told.values()) == {""}


def test_what_is_real_is_not_simulated() -> None:
    real = replace(SIMULATED, robot="tcp://nao.local:9559", cloud="https://rapp.example")
    table = {agent.name: agent.words for agent in agents(HOME, real)}
    assert not {"nao_sim", "cloud"} & set(table)
    assert "tcp://nao.local:9559" in table["core_agent"]


def test_the_users_own_ros_does_not_move_our_names() -> None:
    env = environment(HOME, SIMULATED, {"ROS_NAMESPACE": "mine", "ROS_MASTER_URI": "http://elsewhere:11311", "PATH": "/bin"})
    assert (env["ROS_MASTER_URI"], env["PATH"]) == ("http://127.0.0.1:11311", "/bin")
    assert "ROS_NAMESPACE" not in env
    assert env["RAPP_CLOUD"] == "http://127.0.0.1:9001"
    assert env["RAPP_SMTP_PORT"] == "2525"


def test_a_foreign_platform_needs_what_it_gave_the_robot() -> None:
    with pytest.raises(UsageError, match="RAPP_TOKEN_FILE"):
        environment(HOME, replace(SIMULATED, cloud="https://rapp.example"), {})
