"""What integration tests share: a real ROS master, and processes of ours started with it."""

import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

READY_TIMEOUT = 30.0  # s
STOP_TIMEOUT = 10.0  # s


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Running:
    """A started process of ours and what its READY line said."""

    def __init__(self, process: subprocess.Popen[str], ready: dict[str, Any]) -> None:
        self.process = process
        self.ready = ready

    def stop(self, number: int = signal.SIGTERM) -> int:
        """End the process; gives its exit status; a process that does not end is killed and fails the test."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
            raise


@contextmanager
def running(words: list[str], env: dict[str, str], log: Path) -> Iterator[Running]:
    """A process that prints READY, ended at the end; its stderr goes to `log`."""
    with log.open("ab") as errors:
        process = subprocess.Popen(words, env=env, stdout=subprocess.PIPE, stderr=errors, text=True, start_new_session=True)
    started = Running(process, {})
    try:
        started.ready = _wait_ready(process, log)
        yield started
    finally:
        started.stop()
        assert process.stdout is not None
        process.stdout.close()


def _wait_ready(process: subprocess.Popen[str], log: Path) -> dict[str, Any]:
    assert process.stdout is not None
    deadline = time.monotonic() + READY_TIMEOUT
    while time.monotonic() < deadline:
        readable, _, _ = select.select([process.stdout], [], [], 0.2)
        line = process.stdout.readline() if readable else ""
        if line.startswith("READY "):
            ready: dict[str, Any] = json.loads(line[6:])
            return ready
        if process.poll() is not None:
            break
    raise AssertionError(f"{process.args} did not become ready:\n{log.read_text()[-3000:]}")


class RosMaster:
    """A real ROS master, which can be killed, frozen, and started again at the same address."""

    def __init__(self, folder: Path) -> None:
        self._port = free_port()
        self._folder = folder
        self.uri = f"http://127.0.0.1:{self._port}"
        self.env = {**os.environ, "ROS_LOG_DIR": str(folder), "ROS_MASTER_URI": self.uri, "ROS_IP": "127.0.0.1"}

    def start(self) -> None:
        """Start it; returns when it listens."""
        with (self._folder / "rosmaster.log").open("a") as log:
            words = ["rosmaster", "--core", "-p", str(self._port)]
            self._process = subprocess.Popen(words, env=self.env, stdout=log, stderr=log)
        _wait_port(self._port)

    def signal(self, number: int) -> None:
        """Send it a signal."""
        self._process.send_signal(number)

    def stop(self) -> None:
        """End and reap it, even a frozen one."""
        self._process.terminate()
        self._process.send_signal(signal.SIGCONT)
        self._process.wait(STOP_TIMEOUT)


@contextmanager
def _running_master(folder: Path) -> Iterator[RosMaster]:
    master = RosMaster(folder)
    master.start()
    try:
        yield master
    finally:
        master.stop()


@pytest.fixture(scope="session")
def roscore(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """URI of a real ROS master of this test session's own."""
    with _running_master(tmp_path_factory.mktemp("roscore")) as master:
        yield master.uri


@pytest.fixture
def own_master(tmp_path: Path) -> Iterator[RosMaster]:
    """A ROS master of one test's own, to be killed or frozen."""
    with _running_master(tmp_path) as master:
        yield master


def _wait_port(port: int) -> None:
    deadline = time.monotonic() + READY_TIMEOUT
    while time.monotonic() < deadline:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    raise AssertionError(f"nothing listens on port {port}")


@pytest.fixture(scope="session")
def ros_env(roscore: str, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment of a process that joins the test session's ROS master."""
    logs = str(tmp_path_factory.mktemp("roslogs"))
    return {**os.environ, "ROS_MASTER_URI": roscore, "ROS_IP": "127.0.0.1", "ROS_LOG_DIR": logs}


Start = Callable[..., Running]


@contextmanager
def _starter(ros_env: dict[str, str], folder: Path) -> Iterator[Start]:
    with ExitStack() as stack:

        def start_module(module: str, *words: str, env: dict[str, str] | None = None) -> Running:
            command = [sys.executable, "-m", module, *words]
            return stack.enter_context(running(command, {**ros_env, **(env or {})}, folder / f"{module}.log"))

        yield start_module


@pytest.fixture
def start(ros_env: dict[str, str], tmp_path: Path) -> Iterator[Start]:
    """Starts `python -m MODULE WORDS...` in the test's ROS; everything is ended, last first, after the test."""
    with _starter(ros_env, tmp_path) as starter:
        yield starter


@pytest.fixture(scope="module")
def start_for_module(ros_env: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Start]:
    """As `start`; everything is ended after the last test of the file."""
    with _starter(ros_env, tmp_path_factory.mktemp("started")) as starter:
        yield starter
