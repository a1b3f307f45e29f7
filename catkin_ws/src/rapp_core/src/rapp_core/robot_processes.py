"""All processes of a robot, without roslaunch: started in order, watched, ended in reverse order (`scripts/robot`)."""

import argparse
import json
import logging
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

from rapp_core.config import Config, read
from rapp_core.errors import CoreError, Unreachable

_log = logging.getLogger(__name__)
READY_TIMEOUT = 30.0  # s, of one process
TERM_TIMEOUT = 8.0  # s, from SIGTERM to SIGKILL


class Processes:
    """The started processes; `close` ends them all, last started first."""

    def __init__(self, logs: Path, env: dict[str, str]) -> None:
        self._logs = logs
        self._env = env
        self._started: list[tuple[str, subprocess.Popen[str]]] = []
        logs.mkdir(parents=True, exist_ok=True)

    def start(self, name: str, words: Sequence[str], ready: bool = True) -> dict[str, Any]:
        """Start one; gives what its READY line says. Raises Unreachable with the end of its log."""
        with (self._logs / f"{name}.log").open("w") as log:
            process = subprocess.Popen(
                words,
                env=self._env,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE if ready else log,
                stderr=log,
                text=True,
                start_new_session=True,
            )
        self._started.append((name, process))
        return self._wait_ready(name, process) if ready else {}

    def _wait_ready(self, name: str, process: "subprocess.Popen[str]") -> dict[str, Any]:
        assert process.stdout is not None
        deadline = time.monotonic() + READY_TIMEOUT
        while time.monotonic() < deadline:
            readable, _, _ = select.select([process.stdout], [], [], 0.2)
            line = process.stdout.readline() if readable else ""
            if line.startswith("READY "):
                threading.Thread(target=_drain, args=(process.stdout,), daemon=True).start()
                return dict(json.loads(line[6:]))
            if process.poll() is not None:
                break
        tail = "\n".join((self._logs / f"{name}.log").read_text(errors="replace").splitlines()[-15:])
        raise Unreachable(f"cannot start {name}: it did not become ready; its log ends:\n{tail}")

    def ended(self) -> str | None:
        """Name of a process that has ended by itself; None while all run."""
        return next((name for name, process in self._started if process.poll() is not None), None)

    def close(self) -> None:
        """End all."""
        while self._started:
            name, process = self._started.pop()
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
            try:
                process.wait(TERM_TIMEOUT)
            except subprocess.TimeoutExpired:
                _log.warning("%s did not end: killed", name)
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def _drain(stream: IO[str]) -> None:
    for _line in stream:
        continue  # a full pipe would block the process


def main() -> int:
    """Run a robot until SIGINT, SIGTERM, or the end of one of its processes; gives the exit status."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    parser = argparse.ArgumentParser(prog="robot", description="all processes of a robot", epilog="Other options: core_agent.")
    parser.add_argument("--simulator", default="", help="options of nao_sim, as one word, such as '--microphone text'")
    parser.add_argument("--master-port", type=int, default=0, help="of roscore; 0: any free one")
    parser.add_argument("--bridge-port", type=int, default=0, help="of rosbridge; 0: any free one")
    options, rest = parser.parse_known_args()
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    port = options.master_port or _free_port()
    config = read(rest)
    own = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "RAPP_HOME": str(config.home)}
    env = {**os.environ, **own, "ROS_LOG_DIR": str(config.home / "logs" / "ros")}
    processes = Processes(config.home / "logs", env)
    try:
        ready = _start(processes, config, options, rest, port)
        print("READY " + json.dumps({**ready, "master": own["ROS_MASTER_URI"]}), flush=True)
        while not stop.wait(0.2):
            if (name := processes.ended()) is not None:
                _log.error("%s has ended; see %s", name, config.home / "logs")
                return 1
    except CoreError as error:
        _log.error("%s", error)
        return 1
    finally:
        processes.close()
    return 0


def _start(processes: Processes, config: Config, options: argparse.Namespace, rest: list[str], port: int) -> dict[str, str]:
    processes.start("roscore", ["rosmaster", "--core", "-p", str(port)], ready=False)
    _wait_port(port)
    url = config.robot if config.robot != Config.robot else _simulator(processes, config, options.simulator.split())
    bridge = processes.start("rosbridge", _module("rapp_bridge", "--port", str(options.bridge_port)))
    bridge_url = f"ws://127.0.0.1:{bridge['port']}"
    processes.start("link", _module("rapp_link", "--bridge", bridge_url, "--home", str(config.home)))
    processes.start("core_agent", _module("rapp_core", *rest, "--robot", url))
    return {"bridge": bridge_url, "robot": url}


def _simulator(processes: Processes, config: Config, words: list[str]) -> str:
    ready = processes.start("nao_sim", _module("rapp_nao_sim", "--port", "0", "--files", str(config.home), *words))
    return f"tcp://127.0.0.1:{ready['port']}"


def _module(name: str, *words: str) -> list[str]:
    return [sys.executable, "-m", name, *words]


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _wait_port(port: int) -> None:
    deadline = time.monotonic() + READY_TIMEOUT
    while time.monotonic() < deadline:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    raise Unreachable(f"cannot start roscore: nothing listens on port {port}")


if __name__ == "__main__":
    sys.exit(main())
