"""The processes of one robot (DESIGN section 1), and the order in which they start."""

import logging
import socket
import sys
import threading
from collections.abc import Mapping
from typing import Any

from rapp_core.robot_processes.child import Child
from rapp_core.robot_processes.config import RobotConfig

LINK = "link"
SECRETS = ("RAPP_SMTP_PASSWORD",)  # variables of the environment that only the link is told

_log = logging.getLogger(__name__)


class RobotProcesses:
    """Started by `start`, ended in reverse order by `end`."""

    def __init__(self, config: RobotConfig, env: Mapping[str, str], stop: threading.Event) -> None:
        self._config = config
        self._port = config.master_port or _free_port()
        self.master = f"http://127.0.0.1:{self._port}"
        self._env = {
            **env,
            "ROS_MASTER_URI": self.master,
            "ROS_IP": "127.0.0.1",
            "ROS_LOG_DIR": str(config.home / "logs" / "ros"),
            "RAPP_HOME": str(config.home),
            "RAPP_ROBOT_NAME": config.name,
        }
        self._stop = stop
        self._children: list[Child] = []

    def start(self) -> dict[str, Any]:
        """Start all; gives where they are reached. Raises ChildError; `end` is due even then."""
        config = self._config
        config.home.mkdir(parents=True, exist_ok=True)
        master = self._child("roscore", "rosmaster", "--core", "-p", str(self._port))
        sim = None
        if config.robot is None:
            sim = self._module("nao_sim", "--port", "0", "--files", str(config.home), *config.sim, module="rapp_nao_sim")
        master.wait_port(self._port, config.ready, self._stop)
        bridge = self._module("rosbridge", "--port", str(config.bridge_port), module="rapp_bridge")
        url = f"ws://127.0.0.1:{bridge.wait_ready(config.ready, self._stop)['port']}"
        link = self._module(LINK, "--bridge", url, module="rapp_link")
        robot = config.robot or f"tcp://127.0.0.1:{self._ready(sim)['port']}"
        link.wait_ready(config.ready, self._stop)
        words = ["--robot", robot, "--home", str(config.home), "--name", config.name, *config.core]
        self._ready(self._module("core_agent", *words, module="rapp_core"))
        return {"bridge": url, "robot": robot, "master": self.master}

    def _ready(self, child: Child | None) -> dict[str, Any]:
        assert child is not None
        return child.wait_ready(self._config.ready, self._stop)

    def _module(self, name: str, *words: str, module: str) -> Child:
        return self._child(name, sys.executable, "-m", module, *words)

    def _child(self, name: str, *words: str) -> Child:
        env = self._env if name == LINK else {key: value for key, value in self._env.items() if key not in SECRETS}
        child = Child(name, words, env, self._config.home / "logs" / f"{name}.log")
        self._children.append(child)
        _log.info("%s started", name)
        return child

    def ended(self) -> Child | None:
        """A child that has ended by itself, if any."""
        return next((child for child in self._children if child.status is not None), None)

    def end(self) -> None:
        """End and reap all, last started first."""
        while self._children:
            child = self._children.pop()
            child.end(self._config.end)
            _log.info("%s ended", child.name)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
