"""A platform as a process with two robots, which can be killed and started again on the same folder."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fakes.whole_robot import processes_of
from rapp_hop.client import HopClient

PATIENCE = 30.0  # s
ROBOTS = ("nao", "other")
Test = Callable[[HopClient, HopClient], Awaitable[None]]


class CloudProcess:
    """Its data folder, and the process that serves it."""

    def __init__(self, folder: Path, packages: Sequence[Path], **settings: object) -> None:
        """Make the folder; settings are those of `CloudConfig`."""
        self.data = folder / "cloud"
        self.log = folder / "cloud.log"
        self.port = 0
        self._packages = packages
        self._env = {**os.environ, **{f"RAPP_CLOUD_{name.upper()}": str(value) for name, value in settings.items()}}
        self._process: subprocess.Popen[str] | None = None
        for robot in ROBOTS:
            words = [sys.executable, "-m", "rapp_cloud", "init", "--data", str(self.data), "--robot", robot]
            subprocess.run(words, env=self._env, check=True, timeout=PATIENCE, capture_output=True)

    def start(self) -> None:
        """Start it; returns when it serves."""
        words = [sys.executable, "-m", "rapp_cloud", "--port", "0", "--data", str(self.data), "--workers", "1"]
        words += [word for package in self._packages for word in ("--publish", str(package))]
        with self.log.open("a") as log:
            self._process = subprocess.Popen(words, env=self._env, stdout=subprocess.PIPE, stderr=log, text=True)
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        assert line.startswith("READY "), self.log.read_text()
        self.port = json.loads(line[6:])["port"]

    @property
    def pid(self) -> int:
        """Its process id."""
        assert self._process is not None
        return self._process.pid

    def stop(self, number: int = signal.SIGTERM) -> int:
        """End it; gives its exit status."""
        process, self._process = self._process, None
        if process is None:
            return 0
        process.send_signal(number)
        try:
            return process.wait(PATIENCE)
        finally:
            process.kill()
            process.communicate()

    def run(self, test: Test) -> None:
        """Run a test with a client for each robot, the first of which is registered."""

        async def main() -> None:
            clients = [self._client(robot) for robot in ROBOTS]
            try:
                await clients[0].call("register", {"kind": "nao", "api_version": "1.0"})
                await test(clients[0], clients[1])
            finally:
                for client in clients:
                    await client.close()

        asyncio.run(main())

    def _client(self, robot: str) -> HopClient:
        token = (self.data / "robots" / f"{robot}.token").read_text()
        return HopClient(f"http://127.0.0.1:{self.port}", token)

    def agents(self) -> list[str]:
        """Folders of cloud agents, not that of the spare."""
        return sorted({str(path.parent.parent) for path in (self.data / "agents" / "runs").glob("*/package/*")})

    def left(self) -> list[str]:
        """Command lines of all processes of agents and of the spare."""
        return processes_of(self.data / "agents" / "runs")

    def until_nothing_is_left(self) -> None:
        """Wait until no process and no folder of any agent is left."""
        deadline = time.monotonic() + PATIENCE
        while left := [*self.left(), *(self.data / "agents" / "runs").iterdir()]:
            assert time.monotonic() < deadline, left
            time.sleep(0.05)


@contextmanager
def cloud_process(folder: Path, packages: Sequence[Path], **settings: object) -> Iterator[CloudProcess]:
    """A started one, ended at the end."""
    cloud = CloudProcess(folder, packages, **settings)
    cloud.start()
    try:
        yield cloud
    finally:
        cloud.stop()


async def start(client: HopClient, run: str = "r1", rapp: str = "probe", **more: Any) -> str:
    """Start a cloud agent; gives its id."""
    return str((await client.call("start_cloud_agent", {"rapp": rapp, "version": "1.0.0", "run": run, **more}))["agent"])
