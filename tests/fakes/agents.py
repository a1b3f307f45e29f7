"""Dynamic agents without processes: each run follows a script of what it sends when."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fakes.clock import Clock, TimedEvent
from rapp_core.errors import CoreError
from rapp_core.manifest import Manifest, read_manifest
from rapp_core.ports import Signal, Told

BEAT = 0.25  # s


@dataclass
class Script:
    """What a dynamic agent does; times in s after its activation, None for never."""

    first_word: float | None = 0.1
    terminate: float | None = 1.0
    outcome: tuple[str, str] = ("done", "")
    crash: float | None = None
    silent: float | None = None  # from then on no heartbeat
    stuck: float | None = None  # from then on its own loop stands still
    waits: bool = True  # for a core service, as far as it says
    answers_dismantle: bool = True
    acts: list[tuple[float, Callable[["FakeAgent"], None]]] = field(default_factory=list)


class FakeAgent:
    """Implements `ports.Agent`."""

    def __init__(self, clock: Clock, folder: Path, manifest: Manifest, script: Script, journal: list[str], told: Told) -> None:
        self.name, self.token = folder.name, f"secret of {folder.name}"
        self.manifest: Manifest | None = manifest
        self.recordings, self.package = folder / "recordings", folder / "package"
        self.alive = True
        self.first_word = TimedEvent(clock)
        self.outcome: tuple[str, str] | None = None
        self.waits = script.waits
        self.heartbeat = self.progress = clock.now()
        self._clock, self._script, self._journal, self._told, self._start = clock, script, journal, told, clock.now()
        self._plan()

    def _plan(self) -> None:
        script = self._script
        if script.first_word is not None:
            self._clock.after(script.first_word, self._speak)
        if script.terminate is not None:
            self._clock.after(script.terminate, self._terminate)
        if script.crash is not None:
            self._clock.after(script.crash, lambda: setattr(self, "alive", False))
        for time, act in script.acts:
            self._clock.after(time, lambda act=act: act(self))  # type: ignore[misc]
        self._clock.after(BEAT, self._beat)

    def _beat(self) -> None:
        age = self._clock.now() - self._start
        if not self.alive or (self._script.silent is not None and age >= self._script.silent):
            return
        self.heartbeat = self._clock.now()
        if self._script.stuck is None or age < self._script.stuck:
            self.progress = self.heartbeat
        self._clock.after(BEAT, self._beat)

    def _speak(self) -> None:
        self.first_word.set()
        self._told({"type": "first_word", "name": self.name})

    def _terminate(self) -> None:
        self.outcome = self._script.outcome
        self._told({"type": "terminate", "outcome": self.outcome[0], "detail": self.outcome[1]})

    def dismantle(self, patience: float, hurry: Signal) -> bool:
        self._journal.append("dismantle")
        if self._script.answers_dismantle:
            self._told({"type": "gone"})
        else:
            self._clock.advance(patience)
        return self._script.answers_dismantle

    def end(self, patience: float, keep_log: Path | None = None) -> None:
        self._journal.append("end")
        self.alive = False


class FakeAgents:
    """Implements `ports.Agents`; the next run follows `script`, or fails with `error`."""

    def __init__(self, clock: Clock, home: Path, journal: list[str]) -> None:
        self.script = Script()
        self.error: CoreError | None = None
        self.runs: list[FakeAgent] = []
        self._clock, self._home, self._journal = clock, home, journal

    def prepare(self) -> None:
        self._journal.append("prepare")

    def activate(self, package: Path, told: Callable[[dict[str, Any]], None]) -> FakeAgent:
        if self.error is not None:
            raise self.error
        self._journal.append(f"activate {package.name}")
        folder = self._home / "runs" / str(len(self.runs))
        run = FakeAgent(self._clock, folder, read_manifest(package), self.script, self._journal, told)
        self.runs.append(run)
        told({"type": "activate"})
        return run

    def log_of(self, manifest: Manifest) -> Path:
        return self._home / "logs" / f"{manifest.name}.log"
