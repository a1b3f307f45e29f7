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
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import uvloop

TOKEN = "bench-token-0123456789"
BODY = b'{"value": "hello"}'
RIGHT = b'\r\n\r\n"hello"'
HERE = Path(__file__).parent


def call_of(service: str) -> bytes:
    head = f"POST /hop/{service} HTTP/1.1\r\nHost: x\r\nAccept-Token: {TOKEN}\r\nContent-Type: application/json\r\n"
    return f"{head}Content-Length: {len(BODY)}\r\n\r\n".encode() + BODY


@contextmanager
def child(words: list[str]) -> Iterator[subprocess.Popen[str]]:
    """A process that is ended, and killed when it does not end."""
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE.parent), os.environ.get("PYTHONPATH", "")])}
    process = subprocess.Popen(words, env=env, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def ready_of(process: subprocess.Popen[str]) -> dict[str, Any]:
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line.startswith("READY"):
        raise SystemExit(f"cannot start {process.args}")
    found: dict[str, Any] = json.loads(line.removeprefix("READY "))
    return found


def cpu(pid: int) -> float:
    """Processor seconds a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Caller(asyncio.Protocol):
    """One keep-alive connection, one call after another."""

    def __init__(self, call: bytes) -> None:
        self.took: list[float] = []
        self.failed = ""
        self._bytes = call

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
        self._transport.write(self._bytes)  # type: ignore[attr-defined]


async def load(port: int, call: bytes, connections: int, seconds: float) -> tuple[float, list[float]]:
    """Calls per second, and the seconds of each."""
    loop = asyncio.get_running_loop()
    made = [await loop.create_connection(lambda: Caller(call), "127.0.0.1", port) for _ in range(connections)]
    callers = [caller for _, caller in made]
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

    def __init__(self, words: list[str], stack: ExitStack) -> None:
        process = stack.enter_context(child([sys.executable, *words]))
        ready = ready_of(process)
        self.port = ready["port"]
        self.pids = ready.get("pids", [process.pid])


class Row:
    """A service of a server, measured in rounds."""

    def __init__(self, name: str, server: Server, service: str) -> None:
        self.name = name
        self._server = server
        self._call = call_of(service)
        self.rates: list[float] = []
        self._took: list[float] = []
        self._used = 0.0

    def measure(self, connections: int, seconds: float) -> None:
        before = sum(map(cpu, self._server.pids))
        rate, took = uvloop.run(load(self._server.port, self._call, connections, seconds))
        self._used += sum(map(cpu, self._server.pids)) - before
        self.rates.append(rate)
        self._took += took

    @property
    def each(self) -> float:
        """Processor microseconds of the server for one call."""
        return self._used / len(self._took) / 1.25 * 1e6  # the warming up counts a quarter more

    def line(self, first: "Row") -> str:
        share = statistics.median(mine / theirs for mine, theirs in zip(self.rates, first.rates, strict=True))
        millis = sorted(1000 * one for one in self._took)
        figures = (statistics.median(millis), millis[int(len(millis) * 0.99)])
        end = "".join(f"{one:>9.2f}" for one in figures) + f"{self.each:>12.0f}{first.each / self.each:>10.2f}"
        return f"{self.name:<34}{statistics.median(self.rates):>9.0f}{share:>8.2f}{end}"


def compare(title: str, rows: list[Row], options: argparse.Namespace) -> None:
    """Measure the rows in turn and print them; shares are of the first."""
    for _ in range(options.rounds):
        for row in rows:
            row.measure(options.connections, options.seconds)
    print(f"{title:<34}{'calls/s':>9}{'share':>8}{'p50 ms':>9}{'p99 ms':>9}{'CPU us each':>12}{'CPU share':>10}")
    for row in rows:
        print(row.line(rows[0]))


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
        words = ["-m", "rapp_hop", "benchmarks.hop_services", "--rate", "1e9", "--tokens", str(folder / "tokens.json")]
        words += ["--uploads", str(folder / "uploads")]
        bare = Server([str(HERE / "hop_bare.py")], stack)
        one = Server(words, stack)
        all_ = Server([*words, "--processes", str(cores)], stack)
        several = f"HOP, {cores} processes"
        print(f"{options.connections} keep-alive connections, {cores} cores, the load on one of them")
        echoes = [Row("bare Tornado handler", bare, "echo"), Row("HOP, one process", one, "echo"), Row(several, all_, "echo")]
        compare("echo", echoes, options)
        compare("2 ms of work", [Row("HOP, one process", one, "burn"), Row(several, all_, "burn")], options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
