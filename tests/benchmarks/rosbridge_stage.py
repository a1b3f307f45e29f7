"""What `rosbridge.py` measures with: a ROS master, two rospy nodes, a bare WebSocket server and the bridge, each a process."""

import asyncio
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosbridge_client import PATIENCE, Client, connect

CPU_CLOCK = 2  # of a process, to the nanosecond; clock_getcpuclockid(3) makes its number so
HERE = Path(__file__).parent


class Process:
    """A process that prints READY, and whose use of the processor and of memory is read."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self.process = process
        line = self.line()
        if not line.startswith("READY"):
            raise SystemExit(f"cannot start {process.args}")
        self.ready: dict[str, Any] = json.loads(line.removeprefix("READY").strip() or "{}")

    def line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline()

    def cpu(self) -> float:
        """Seconds of processor time that it has used."""
        return time.clock_gettime(~self.process.pid << 3 | CPU_CLOCK)

    def memory(self) -> float:
        """Resident memory, MB."""
        return int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6

    def descriptors(self) -> int:
        return len(list(Path(f"/proc/{self.process.pid}/fd").iterdir()))


class Node(Process):
    """A rospy node that does what it is told, see `rosbridge_node.py`."""

    def tell(self, do: str, **words: Any) -> "asyncio.Task[dict[str, Any]]":
        """Have it begin; the task ends with its answer. One at a time, or in order of their ends."""
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps({"do": do, **words}) + "\n")
        self.process.stdin.flush()
        return asyncio.create_task(self._answer(do))

    async def _answer(self, do: str) -> dict[str, Any]:
        answer: dict[str, Any] = json.loads(await asyncio.wait_for(asyncio.to_thread(self.line), 2 * PATIENCE))
        if answer["do"] != do:
            raise SystemExit(f"cannot go on: the node answers {answer}")
        return answer


@dataclass(frozen=True)
class Stage:
    """All that runs."""

    bridge: Process
    bare: Process
    node: Node
    other: Node

    async def client(self) -> Client:
        """A client of the bridge."""
        return await connect(self.bridge.ready["port"])

    @asynccontextmanager
    async def clients(self, count: int, *, bare: bool = False) -> AsyncIterator[list[Client]]:
        """Clients of the bridge, or of the bare server, until the end."""
        port = (self.bare if bare else self.bridge).ready["port"]
        found = [await connect(port) for _ in range(count)]
        try:
            yield found
        finally:
            for client in found:
                client.close()


@contextmanager
def staged(folder: str) -> Iterator[Stage]:
    """Everything running; ended afterwards, last first."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
    env = {**os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "ROS_LOG_DIR": folder}
    with ExitStack() as stack:
        stack.enter_context(_child(["rosmaster", "--core", "-p", str(port)], env))
        _wait_for(port)

        def start(*words: str) -> "subprocess.Popen[str]":
            return stack.enter_context(_child([sys.executable, *words], env))

        node, other = (Node(start(str(HERE / "rosbridge_node.py"), *words)) for words in (["--serve"], []))
        bare = Process(start(str(HERE / "rosbridge_bare.py")))
        yield Stage(Process(start("-m", "rapp_bridge", "--port", "0")), bare, node, other)


@contextmanager
def _child(words: list[str], env: dict[str, str]) -> Iterator["subprocess.Popen[str]"]:
    """A process that is ended, and killed when it does not end."""
    pipe = subprocess.PIPE
    process = subprocess.Popen(words, env=env, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.communicate(timeout=5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def _wait_for(port: int) -> None:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    raise SystemExit("cannot start: the ROS master does not come up")
