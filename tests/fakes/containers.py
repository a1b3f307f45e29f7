"""A composition of containers on a real Docker engine: built, started, cut from its networks, killed, and taken down whole."""

import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from rapp_cli.paths import ROOT

COMPOSE_FILE = ROOT / "docker" / "compose.yaml"
ENGINE = Path("shared/tools/container-engine")  # in a folder above the repository; starts an engine where none runs
STEP = 0.5  # s between two looks


def engine_environment() -> dict[str, str]:
    """The environment in which `docker` reaches an engine; starts one where there is the means, else skips the test."""
    env = dict(os.environ)
    if shutil.which("docker") and _engine_answers(env):
        return env
    script = next((folder / ENGINE for folder in ROOT.parents if (folder / ENGINE).exists()), None)
    if script is None:
        pytest.skip("no Docker engine answers here: start one, and set DOCKER_HOST to it")
    up = subprocess.run([str(script), "up"], capture_output=True, text=True, timeout=600, check=False)
    env["DOCKER_HOST"] = up.stdout.partition("DOCKER_HOST=")[2].strip()
    assert _engine_answers(env), f"{up.stdout}\n{up.stderr}"
    return env


def _engine_answers(env: Mapping[str, str]) -> bool:
    asked = subprocess.run(["docker", "version"], env=env, capture_output=True, timeout=60, check=False)
    return asked.returncode == 0


class Composition:
    """The containers of docker/compose.yaml under a project name of their own."""

    def __init__(self, env: Mapping[str, str]) -> None:
        self.project = f"rapp-test-{os.getpid()}"
        self.port = _free_port()
        self._env = {**env, "RAPP_PORT": str(self.port)}
        self._compose = ["docker-compose"] if shutil.which("docker-compose") else ["docker", "compose"]

    def compose(self, *words: str, timeout: float = 300) -> str:
        """Run a command of docker-compose that must succeed; gives what it prints."""
        return self._run([*self._compose, "-p", self.project, "-f", str(COMPOSE_FILE), *words], timeout)

    def docker(self, *words: str, timeout: float = 60) -> str:
        """Run a command of docker that must succeed; gives what it prints."""
        return self._run(["docker", *words], timeout)

    def _run(self, words: list[str], timeout: float) -> str:
        done = subprocess.run(words, env=self._env, capture_output=True, text=True, timeout=timeout, check=False)
        assert done.returncode == 0, f"{' '.join(words)}:\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
        return done.stdout

    def container(self, service: str) -> str:
        """The id of a service's container."""
        return self.compose("ps", "-q", service).strip()

    def inspect(self, service: str) -> dict[str, Any]:
        """What the engine knows of a service's container."""
        found: list[dict[str, Any]] = json.loads(self.docker("inspect", self.container(service)))
        return found[0]

    def inside(self, service: str, *words: str, timeout: float = 120) -> subprocess.CompletedProcess[str]:
        """Run a command in a service's container, whatever it answers."""
        command = ["docker", "exec", self.container(service), *words]
        return subprocess.run(command, env=self._env, capture_output=True, text=True, timeout=timeout, check=False)

    def begin(self, service: str, *words: str) -> subprocess.Popen[str]:
        """Begin a command in a service's container; its output can be read while it runs."""
        command = ["docker", "exec", self.container(service), *words]
        return subprocess.Popen(command, env=self._env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def until(self, met: Callable[[], bool], what: str, timeout: float = 120) -> None:
        """Wait until a condition is met; fails with all logs after `timeout` s."""
        deadline = time.monotonic() + timeout
        while not met():
            assert time.monotonic() < deadline, f"not within {timeout:g} s: {what}\n{self.logs()}"
            time.sleep(STEP)

    def healthy(self, *services: str) -> None:
        """Wait until the containers of these services say that they are healthy."""
        for service in services:
            self.until(partial(self._is_healthy, service), f"{service} healthy")

    def _is_healthy(self, service: str) -> bool:
        return bool(self.inspect(service)["State"].get("Health", {}).get("Status") == "healthy")

    def network(self, action: str, service: str, network: str) -> None:
        """`connect` or `disconnect` a service's container; connected again, it has its name there as before."""
        alias = ["--alias", service] if action == "connect" else []
        self.docker("network", action, *alias, f"{self.project}_{network}", self.container(service))

    def logs(self) -> str:
        """The ends of all containers' logs: who did what."""
        return self.compose("logs", "--no-color", "--tail", "40")

    def left(self) -> dict[str, list[str]]:
        """What the engine still has of the project."""
        own = f"label=com.docker.compose.project={self.project}"
        kinds = {"container": ["ps", "-a"], "volume": ["volume", "ls"], "network": ["network", "ls"]}
        return {kind: self.docker(*words, "-q", "--filter", own).split() for kind, words in kinds.items()}


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
