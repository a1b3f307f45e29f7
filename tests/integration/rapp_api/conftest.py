"""A core agent's side for the runner: a real ROS node that serves it, and the other end of its channel."""

import json
import os
import secrets
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from fakes.rapps import write_rapp

PATIENCE = 20.0  # s for what has to happen


class CoreNode:
    """The node of `core_node.py`: its secret, and what it was asked."""

    def __init__(self, notes: Path) -> None:
        self.notes = notes
        self.secret = secrets.token_hex(8)

    def calls(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.notes.read_text().splitlines()] if self.notes.exists() else []


@pytest.fixture
def core(ros_env: dict[str, str], tmp_path: Path) -> Iterator[CoreNode]:
    node = CoreNode(tmp_path / "calls")
    words = [sys.executable, str(Path(__file__).with_name("core_node.py")), str(node.notes), node.secret]
    process = subprocess.Popen(words, env=ros_env, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("READY")
        yield node
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE)


class Runner:
    """A runner process and the core agent's end of its channel."""

    def __init__(self, env: dict[str, str], log: Path) -> None:
        self.log = log
        self._end, theirs = socket.socketpair()
        with theirs, log.open("wb") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "rapp_api.runner"],
                env={**env, "RAPP_CHANNEL_FD": str(theirs.fileno())},
                pass_fds=(theirs.fileno(),),
                stdout=output,
                stderr=output,
                start_new_session=True,
            )
        self._rest = b""
        self.seen: list[dict[str, Any]] = []

    def send(self, **message: Any) -> None:
        self._end.sendall(json.dumps(message).encode() + b"\n")

    def activate(self, package: Path, secret: str, **parameters: Any) -> None:
        self.send(type="activate", run="r1", token=secret, package=str(package), entry="agent.py", parameters=parameters)

    def until(self, kind: str, match: Callable[[dict[str, Any]], bool] = lambda _message: True) -> dict[str, Any]:
        """The next message of that type; those before it are in `seen`."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            line, newline, rest = self._rest.partition(b"\n")
            if newline:
                self._rest = rest
                message = json.loads(line)
                self.seen.append(message)
                if message["type"] == kind and match(message):
                    return dict(message)
            elif select.select([self._end], [], [], 0.2)[0]:
                piece = self._end.recv(65536)
                assert piece, f"the channel has ended before {kind}: {self.log.read_text()[-3000:]}"
                self._rest += piece
        raise AssertionError(f"no {kind} came; seen {self.seen[-9:]}; {self.log.read_text()[-3000:]}")

    def hang_up(self) -> None:
        self._end.close()

    def wait(self) -> int:
        return self.process.wait(PATIENCE)

    def close(self) -> None:
        self._end.close()
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait(PATIENCE)


Rapp = Callable[..., Path]


@pytest.fixture
def spare(ros_env: dict[str, str], tmp_path: Path) -> Iterator[Callable[[], Runner]]:
    """Starts runners; gives each once it is ready."""
    with ExitStack() as stack:

        def start() -> Runner:
            runner = Runner(ros_env, tmp_path / f"runner-{len(list(tmp_path.glob('runner-*')))}.log")
            stack.callback(runner.close)
            runner.until("ready")
            return runner

        yield start


@pytest.fixture
def rapp(tmp_path: Path) -> Rapp:
    """Writes a RApp whose agent executes the given lines."""

    def write(body: str) -> Path:
        return write_rapp(tmp_path / "package", "probe", body)

    return write
