"""A real platform on a folder of its own, with as many RApps and robots as a measurement wants."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fakes.processes import children, stat
from rapp_cloud.memory import open_memory

PATIENCE = 120.0  # s
LEARNING = 600.0  # s that a platform may take to learn what it offers
MEGABYTE = 2**20


def write_rapp(folder: Path, name: str, version: str = "1.0.0", size: int = 0, sentences: Sequence[str] = ()) -> Path:
    """The source of a RApp; `size` bytes of it cannot be packed any smaller."""
    folder.mkdir(parents=True)
    manifest: dict[str, Any] = {
        "name": name, "version": version, "description": "made to be measured",
        "rapp": {
            "agent": "dynamic", "entry": "agent.py", "runtime": "python3",
            "keywords": {"en": [name.replace("_", " ")]}, "sentences": {"en": list(sentences) or [f"please run {name}"]},
            "permissions": {"core": ["rapp_say"], "cloud": []}, "partner": None, "needs": {"robot": ["nao"], "api": ">=1.0"},
        },
    }  # fmt: skip
    (folder / "package.json").write_text(json.dumps(manifest))
    (folder / "agent.py").write_text("from rapp_api import DynamicAgent\n\n\nclass Agent(DynamicAgent):\n    pass\n")
    if size:
        (folder / "sound.bin").write_bytes(random.Random(name + version).randbytes(size))
    return folder


class Platform:
    """A data folder, and the process that serves it now and then."""

    def __init__(self, folder: Path) -> None:
        """Make keys, a store and a robot's token."""
        self.data = folder / "cloud"
        self.log = folder / "cloud.log"
        self.port = 0
        self.pid = 0
        self.ready = self.settled = 0.0  # by `clock`: serving; with nothing left to do
        self.command("init", "--robot", "nao", "--host", "127.0.0.1")
        self.token = (self.data / "robots" / "nao.token").read_text()
        self.certificate = self.data / "tls" / "certificate.pem"
        self.key = self.data / "tls" / "key.pem"

    def command(self, name: str, *words: str) -> str:
        """Run a command of the platform; gives what it prints."""
        line = [sys.executable, "-m", "rapp_cloud", name, "--data", str(self.data), *words]
        done = subprocess.run(line, check=False, timeout=PATIENCE, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"cannot go on: rapp_cloud {name}: {done.stderr}")
        return done.stdout

    def publish(self, *sources: Path) -> None:
        """Offer these, by the platform's command."""
        self.command("publish", *map(str, sources))

    def robots(self, count: int) -> dict[str, str]:
        """Accounts for so many robots, each with its own token; by name."""
        names = [f"robot_{number:04}" for number in range(count)]
        with open_memory(self.data) as memory:
            for name in names:
                memory.accounts.open(name, "robot")
            with memory.database.writing() as connection:
                return {name: memory.accounts.add_token(connection, name) for name in names}

    @contextmanager
    def serving(self, *words: str) -> Iterator["Platform"]:
        """The process, ended afterwards."""
        line = [sys.executable, "-m", "rapp_cloud", "--data", str(self.data), "--port", "0", *words]
        with self.log.open("a") as log:
            process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=log, text=True)
        try:
            assert process.stdout is not None
            text = process.stdout.readline()
            if not text.startswith("READY "):
                raise SystemExit(f"cannot start the platform: {self.log.read_text()[-2000:]}")
            self.port, self.pid = json.loads(text[6:])["port"], process.pid
            self.ready = clock()
            self._settle()
            yield self
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            process.communicate()

    def _settle(self) -> None:
        """Wait until its worker processes have loaded their models and learnt what is on offer."""
        used = -1.0
        while clock() < self.ready + LEARNING:
            self.settled = clock()
            before, used = used, cpu(family(self.pid))
            if used - before < 0.02:
                return
            time.sleep(0.5)

    @property
    def url(self) -> str:
        """Where it serves, without TLS."""
        return f"http://127.0.0.1:{self.port}"


def family(pid: int) -> list[int]:
    """A process and those it has started."""
    found = [pid]
    for one in found:
        found += children(one)
    return found


def cpu(pids: Sequence[int]) -> float:
    """Processor seconds that these have used, and their own children that have ended."""
    ticks = 0
    for pid in pids:
        fields = stat(pid)
        ticks += sum(map(int, fields[11:15]))
    return ticks / os.sysconf("SC_CLK_TCK")


def memory(pid: int) -> float:
    """MiB of a process that are its own, and not shared with others."""
    fields = dict(line.split(":") for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:])
    return sum(int(fields[name].split()[0]) for name in ("Private_Clean", "Private_Dirty")) / 1024


def share(values: Sequence[float], part: float) -> float:
    """The value that this part (0..1) of all do not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * part))]


def millis(values: Sequence[float]) -> str:
    """Median and 99th percentile, in ms."""
    return f"{1000 * share(values, 0.5):9.1f}{1000 * share(values, 0.99):9.1f}"


def clock() -> float:
    """Seconds of a clock that goes on steadily."""
    return time.perf_counter()
