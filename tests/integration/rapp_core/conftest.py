"""A launcher with real sandboxes, and what a RApp inside one found out."""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from fakes.rapps import write_rapp
from rapp_core.config import Config, Limits
from rapp_core.launcher.launcher import Launcher
from rapp_core.launcher.run import Run
from rapp_core.ros.services import offered

PATIENCE = 20.0  # s


def wait_for(condition: Callable[[], bool], seconds: float = PATIENCE) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.02)


@pytest.fixture(name="wait_for")
def _wait_for() -> Callable[..., None]:
    return wait_for


class Workshop:
    """Starts RApps written on the spot in real sandboxes."""

    def __init__(self, folder: Path, ros_env: dict[str, str]) -> None:
        self.folder = folder
        ros = {name: ros_env[name] for name in ("ROS_MASTER_URI", "ROS_IP")}
        limits = Limits(memory=1 << 30, cpu=20, processes=40, files=64, file_size=1 << 20, private=4 << 20)
        self.config = Config(home=folder / "home", limits=limits, terminate=2.0)
        self.launcher = Launcher(self.config, ros, offered("/core_agent"))
        self.launcher.open()
        self.heard: list[dict[str, Any]] = []
        self._runs: list[Run] = []
        self._count = 0

    def start(self, body: str, core: Sequence[str] = ("rapp_say",), runtime: str = "python3") -> Run:
        """Activate a RApp whose `execute` is `body`, which may use these core services, and wait for its first word."""
        return self.activate(self.write(body, core, runtime))

    def write(self, body: str, core: Sequence[str] = ("rapp_say",), runtime: str = "python3") -> Path:
        """The package of such a RApp."""
        self._count += 1
        name, permissions = f"probe{self._count}", {"core": list(core), "cloud": []}
        return write_rapp(self.folder / f"package{self._count}", name, body, permissions=permissions, runtime=runtime)

    def activate(self, package: Path) -> Run:
        """Activate a package, and wait for its first word."""
        run = self.launcher.activate(package, self.heard.append)
        self._runs.append(run)
        wait_for(lambda: run.first_word.is_set() or run.outcome is not None or not run.alive)
        return run

    def finish(self, run: Run) -> tuple[str, str]:
        """What the printed text and the outcome of a run are, once it has said "terminate"."""
        wait_for(lambda: run.outcome is not None or not run.alive)
        log = self.folder / f"{run.name}.log"
        run.dismantle(5.0, threading.Event())
        run.end(self.config.terminate, log)
        self._runs.remove(run)
        return log.read_text(), (run.outcome or ("", ""))[0]

    def facts(self, body: str, core: Sequence[str] = ("rapp_say",)) -> Any:
        """What `body` puts into `facts`, found out from inside a sandbox."""
        told = f"import json\nfacts = None\n{body}\nprint('FACTS', json.dumps(facts), flush=True)"
        text, outcome = self.finish(self.start(told, core))
        assert outcome == "done", text
        return json.loads(next(line for line in text.splitlines() if line.startswith("FACTS "))[6:])

    def close(self) -> None:
        for run in self._runs:
            run.end(0.0)
        self.launcher.close()


class Core:
    """The node in the core agent's place."""

    def __init__(self, notes: Path, ros_env: dict[str, str]) -> None:
        self._notes = notes
        words = [sys.executable, str(Path(__file__).with_name("gated_core.py")), str(notes)]
        self.process = subprocess.Popen(words, env=ros_env, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        assert self.process.stdout.readline().startswith("READY")

    def notes(self, name: str) -> list[dict[str, Any]]:
        lines = self._notes.read_text().splitlines() if self._notes.exists() else []
        return [note for note in map(json.loads, lines) if note["name"] == name]


@pytest.fixture(scope="module")
def core(ros_env: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Core]:
    core = Core(tmp_path_factory.mktemp("core") / "notes", ros_env)
    yield core
    core.process.terminate()
    core.process.communicate(timeout=PATIENCE)


@pytest.fixture
def workshop(tmp_path: Path, ros_env: dict[str, str]) -> Iterator[Workshop]:
    workshop = Workshop(tmp_path, ros_env)
    yield workshop
    workshop.close()
