"""What HOP costs: an echo through one server process beside a bare Tornado handler of the same run, and through all cores.

    ./rapp bench hop [--rounds N] [--seconds S] [--connections C]

Starts the servers on free ports of this machine and ends them. They take turns with the same load, so that a busy machine
slows all of them; judge the shares, not the calls per second. The load is a process of its own and needs a core too.
"""

import argparse
import asyncio
import json
import os
import statistics
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import uvloop

from benchmarks.bridge import child, cpu, ready_line

TOKEN = "bench-token-0123456789"
BODY = b'{"value": "hello"}'
CALL = (
    f"POST /hop/echo HTTP/1.1\r\nHost: x\r\nAccept-Token: {TOKEN}\r\nContent-Type: application/json\r\n"
    f"Content-Length: {len(BODY)}\r\n\r\n"
).encode() + BODY
RIGHT = b'\r\n\r\n"hello"'
HERE = Path(__file__).parent


class Caller(asyncio.Protocol):
    """One keep-alive connection, one call after another."""

    def __init__(self) -> None:
        self.took: list[float] = []
        self.failed = ""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = transport
        self._call()

    def data_received(self, data: bytes) -> None:
        self._answer += data
        if self._answer.endswith(RIGHT):
            self.took.append(time.perf_counter() - self._began)
            self._call()
        elif b"\r\n\r\n" in self._answer and not self._answer.startswith(b"HTTP/1.1 200"):
            self.failed = self._answer.decode("latin-1")

    def connection_lost(self, exc: Exception | None) -> None:
        self.failed = self.failed or "the connection was cut"

    def _call(self) -> None:
        self._answer = b""
        self._began = time.perf_counter()
        self._transport.write(CALL)  # type: ignore[attr-defined]


async def load(port: int, connections: int, seconds: float) -> tuple[float, list[float]]:
    """Calls per second, and the seconds of each."""
    loop = asyncio.get_running_loop()
    callers = [(await loop.create_connection(Caller, "127.0.0.1", port))[1] for _ in range(connections)]
    await asyncio.sleep(seconds / 4)
    for caller in callers:
        caller.took.clear()
    began = time.perf_counter()
    await asyncio.sleep(seconds)
    spent = time.perf_counter() - began
    took = [one for caller in callers for one in caller.took]
    failed = next((caller.failed for caller in callers if caller.failed), "")
    for caller in callers:
        caller._transport.close()
    if failed:
        raise SystemExit(f"cannot go on: {failed}")
    return len(took) / spent, took


class Server:
    """One of the servers compared."""

    def __init__(self, name: str, words: list[str], stack: ExitStack) -> None:
        env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE.parent), os.environ.get("PYTHONPATH", "")])}
        process = stack.enter_context(child([sys.executable, *words], env))
        ready = json.loads(ready_line(process).removeprefix("READY "))
        self.name = name
        self.port = ready["port"]
        self.pids = ready.get("pids", [process.pid])
        self.rates: list[float] = []
        self.took: list[float] = []
        self.used = 0.0

    def measure(self, connections: int, seconds: float) -> None:
        before = sum(map(cpu, self.pids))
        rate, took = uvloop.run(load(self.port, connections, seconds))
        self.used += sum(map(cpu, self.pids)) - before
        self.rates.append(rate)
        self.took += took

    def row(self, bare: "Server") -> str:
        share = statistics.median(mine / theirs for mine, theirs in zip(self.rates, bare.rates, strict=True))
        millis = sorted(1000 * one for one in self.took)
        p99 = millis[int(len(millis) * 0.99)]
        each = self.used / len(self.took) / 1.25 * 1e6  # the warming up counts a quarter more
        rate = statistics.median(self.rates)
        return f"{self.name:<34}{rate:>9.0f}{share:>8.2f}{statistics.median(millis):>9.2f}{p99:>9.2f}{each:>12.0f}"


def main() -> int:
    parser = argparse.ArgumentParser(prog="bench hop", description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="of all servers in turn (%(default)s)")
    parser.add_argument("--seconds", type=float, default=1.0, help="of each turn (%(default)s)")
    parser.add_argument("--connections", type=int, default=4, help="keep-alive connections (%(default)s)")
    options = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        (folder / "tokens.json").write_text(json.dumps({TOKEN: "bench"}))
        ours = ["-m", "rapp_hop", "benchmarks.hop_services", "--rate", "1e9", "--tokens", str(folder / "tokens.json")]
        ours += ["--uploads", str(folder / "uploads")]
        bare = Server("bare Tornado handler", [str(HERE / "hop_bare.py")], stack)
        servers = [bare, Server("HOP, one process", ours, stack)]
        servers.append(Server(f"HOP, {cores} processes", [*ours, "--processes", str(cores)], stack))
        for _ in range(options.rounds):
            for server in servers:
                server.measure(options.connections, options.seconds)
        print(f"{options.connections} keep-alive connections, {cores} cores, the load on one of them")
        print(f"{'echo':<34}{'calls/s':>9}{'share':>8}{'p50 ms':>9}{'p99 ms':>9}{'CPU us each':>12}")
        for server in servers:
            print(server.row(bare))
    return 0


if __name__ == "__main__":
    sys.exit(main())
