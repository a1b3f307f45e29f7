"""A launcher with real sandboxes, and what a RApp inside one found out."""

import json
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

    def start(self, body: str, core: Sequence[str] = ("rapp_say",)) -> Run:
        """Activate a RApp whose `execute` is `body`, which may use these core services, and wait for its first word."""
        self._count += 1
        permissions = {"core": list(core), "cloud": []}
        package = write_rapp(self.folder / f"package{self._count}", f"probe{self._count}", body, permissions=permissions)
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


@pytest.fixture
def workshop(tmp_path: Path, ros_env: dict[str, str]) -> Iterator[Workshop]:
    workshop = Workshop(tmp_path, ros_env)
    yield workshop
    workshop.close()
