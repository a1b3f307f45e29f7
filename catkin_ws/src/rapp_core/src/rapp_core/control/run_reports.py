"""What became of each run, for the platform (project abstract: robots "upload useful monitoring information").

A report is made from the trace, written into `reports/` of the robot's folder as the run ends, and given to the link as soon as
that is there; the link keeps it until the platform has it. So neither the end of a process nor a lost network loses one.
"""

import json
import logging
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rapp_core.control.stopping import BY_PERSON
from rapp_core.errors import CoreError, Unreachable
from rapp_core.files import write_whole
from rapp_core.manifest import Manifest
from rapp_core.ports import Agent, Agents, Hop, Told
from rapp_core.trace import Happening, Trace

FOLDER = "reports"
ASKED = 5.0  # s for the link to take one
AGAIN = 2.0  # s between tries while the link is away
KEPT = 100  # reports; the oldest are forgotten
STATES, ERRORS, TEXT = 400, 50, 300  # of one report, and characters of an error
_log = logging.getLogger(__name__)


@dataclass
class _Run:
    """One that goes on."""

    rapp: str
    version: str
    began: float  # monotonic
    wall: float
    agent: Agent | None = None
    states: list[dict[str, Any]] = field(default_factory=list)
    open: dict[str, tuple[dict[str, Any], float]] = field(default_factory=dict)  # by FSM: its state's entry, and since when
    errors: list[dict[str, str]] = field(default_factory=list)
    stopped: bool = False  # by the person: what fails from then on is no error


class RunReports:
    """Stands before the launcher (it is `Agents` itself), and listens to the trace; undone by `close`."""

    def __init__(self, agents: Agents, hop: Hop, home: Path, api_version: str, now: Callable[[], float] = time.monotonic) -> None:
        """Prepare.

        :param home: the robot's folder
        :param api_version: of this core agent
        """
        self._agents = agents
        self._hop = hop
        self._folder = home / FOLDER
        self._versions = {"api": api_version}
        self._now = now
        self._lock = threading.Lock()
        self._run: _Run | None = None
        self._stop, self._something = threading.Event(), threading.Event()
        self._sender = threading.Thread(target=self._send, name="reports", daemon=True)

    def start(self, trace: Trace) -> None:
        """Listen from now on; send what an earlier process has left."""
        trace.listen(self.hear)
        self._something.set()
        self._sender.start()

    def prepare(self) -> None:
        """See `ports.Agents`."""
        self._agents.prepare()

    def log_of(self, manifest: Manifest) -> Path:
        """See `ports.Agents`."""
        return self._agents.log_of(manifest)

    def activate(self, package: Path, told: Told) -> Agent:
        """See `ports.Agents`; a run begins."""
        self._end()
        run = _Run(package.parent.name, package.name, self._now(), time.time())
        with self._lock:
            self._run = run
        try:
            run.agent = self._agents.activate(package, told)
        except CoreError as error:
            self._fail("core", "s7", str(error))
            raise
        if run.agent.manifest is not None:
            run.rapp, run.version = run.agent.manifest.name, run.agent.manifest.version
        return run.agent

    def hear(self, seen: Happening) -> None:
        """Take note of what happens; the run is over when the core agent listens again."""
        if (seen.agent, seen.machine, seen.state, seen.kind) == ("core", "core", "s3", "entered"):
            self._end()
        elif seen.kind == "entered" and (seen.agent == "dynamic" or seen.machine == "core"):
            self._enter(seen)
        elif seen.kind == "message" and seen.detail == f"core: {BY_PERSON}":
            self._stopped()
        elif seen.kind == "failed":
            self._fail(seen.agent, seen.state, seen.detail)
        elif seen.kind == "said" and seen.state == "s11":
            self._fail("core", seen.state, seen.detail)

    def close(self) -> None:
        """End; a run that goes on is reported by the next process."""
        self._end()
        self._stop.set()
        self._something.set()
        if self._sender.is_alive():
            self._sender.join(1.0)

    def _enter(self, seen: Happening) -> None:
        with self._lock:
            run = self._run
            if run is None or len(run.states) >= STATES:
                return
            at, machine = self._now(), f"{seen.agent} {seen.machine}"
            _leave(run, machine, at)
            entry = {"agent": seen.agent, "machine": seen.machine, "state": seen.state, "at": round(at - run.began, 3)}
            run.states.append(entry)
            run.open[machine] = entry, at

    def _stopped(self) -> None:
        with self._lock:
            if self._run is not None:
                self._run.stopped = True

    def _fail(self, agent: str, state: str, detail: str) -> None:
        with self._lock:
            if self._run is not None and not self._run.stopped and len(self._run.errors) < ERRORS:
                self._run.errors.append({"agent": agent, "state": state, "detail": detail[:TEXT]})

    def _end(self) -> None:
        with self._lock:
            run, self._run = self._run, None
            if run is None:
                return
            for machine in list(run.open):
                _leave(run, machine, self._now())
        try:
            self._write(self._report(run))
        except OSError as error:
            _log.warning("cannot keep the report of a run: %s", error)
        self._something.set()

    def _report(self, run: _Run) -> dict[str, Any]:
        outcome = run.agent.outcome if run.agent is not None else None
        errors = list(run.errors)
        done = outcome is not None and outcome[0] == "done"
        if outcome is not None and not done and not run.stopped:
            errors.append({"agent": "dynamic", "state": "", "detail": outcome[1][:TEXT]})
        return {
            "run": run.agent.name if run.agent is not None else secrets.token_hex(6), "rapp": run.rapp, "version": run.version,
            "outcome": "done" if done else "stopped" if run.stopped else "failed",
            "began": round(run.wall, 3), "seconds": round(self._now() - run.began, 3),
            "states": run.states, "errors": errors, "versions": self._versions,
        }  # fmt: skip

    def _write(self, report: dict[str, Any]) -> None:
        self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        path = self._folder / f"{time.time_ns()}-{report['run']}.json"
        write_whole(path, json.dumps(report).encode())
        for old in self._waiting()[:-KEPT]:
            old.unlink(missing_ok=True)

    def _waiting(self) -> list[Path]:
        return sorted(self._folder.glob("*.json"))

    def _send(self) -> None:
        while not self._stop.is_set():
            self._something.wait()
            self._something.clear()
            while not self._stop.is_set() and (waiting := self._waiting()):
                if not self._given(waiting[0]):
                    self._stop.wait(AGAIN)

    def _given(self, path: Path) -> bool:
        try:
            self._hop.request("report", {"run": json.loads(path.read_text("utf-8"))}, ASKED)
        except Unreachable:
            return False
        except (CoreError, OSError, ValueError) as error:
            _log.warning("cannot give the report %s to the link: %s", path.name, error)
        path.unlink(missing_ok=True)
        return True


def _leave(run: _Run, machine: str, at: float) -> None:
    entry, since = run.open.pop(machine, ({}, at))
    entry["seconds"] = round(at - since, 3)
