"""Keeps one confined child warm, and turns it into a dynamic agent on demand (DESIGN section 3.6)."""

import fcntl
import logging
import os
import secrets
import shutil
import socket
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

from rapp_core.config import Config
from rapp_core.errors import Bug, CoreError, Refused, Unreachable
from rapp_core.gate.rules import Offered, rules_for
from rapp_core.launcher import orphans
from rapp_core.launcher.channel import Channel
from rapp_core.launcher.confined import Confined, adopt_orphans
from rapp_core.launcher.gate import Gate
from rapp_core.launcher.run import Run
from rapp_core.launcher.runtimes import check_runtime, runtime_at_hand
from rapp_core.launcher.sandbox import INSIDE_PRIVATE, RunFolders, command
from rapp_core.manifest import Manifest, read_manifest
from rapp_core.ports import Told

INSIDE_MASTER = "http://127.0.0.1:11311"
"""The ROS master that a dynamic agent sees: its gate."""

_log = logging.getLogger(__name__)


class Launcher:
    """Starts, hands out and ends dynamic agents. `open` and `prepare` are undone by `close`.

    All methods are for one thread that lives as long as the process (see `Confined`).
    """

    def __init__(self, config: Config, ros: Mapping[str, str], offered: Offered) -> None:
        """`ros`: environment of a node of the robot's ROS; `offered`: what RApps may be permitted to use there."""
        self._config = config
        self._ros = ros
        self._offered = offered
        self._runs = config.home / "runs"
        self._spare: Run | None = None
        self._lock: int | None = None

    def open(self) -> None:
        """Take the data folder, and clear what an earlier core agent left there. Raises Refused when another one uses it."""
        if self._lock is None:
            self._runs.mkdir(parents=True, exist_ok=True)
            self._lock = os.open(self._config.home / "core_agent.lock", os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                self._unlock()
                home = self._config.home
                raise Refused(f"cannot use {home}: another core agent runs there; give this one its own --home") from error
            orphans.clear(self._runs)
            adopt_orphans()

    def prepare(self) -> None:
        """Have a spare warming up; without one, activation takes longer, so a failure is only logged."""
        if self._spare is not None and self._spare.alive:
            return
        try:
            self._discard_spare()
            self._spare = self._start()
        except Bug as error:
            _log.error("%s", error)

    def activate(self, package: Path, told: Told) -> Run:
        """Run the package as a dynamic agent; gives its run. Raises Refused, Invalid, Unreachable, Bug."""
        manifest = read_manifest(package)
        check_runtime(manifest)
        run = self._take()
        try:
            _copy(package, run.folders.package)
            rules = rules_for(manifest.core, self._offered, self._namespace)
            run.activate(secrets.token_urlsafe(32), manifest, rules, told)
        except (OSError, shutil.Error, CoreError) as error:
            run.end(0.0)
            raise Unreachable(f"cannot start {manifest.name}: {error}") from error
        return run

    def log_of(self, manifest: Manifest) -> Path:
        """Where what a RApp prints is kept after its run, until its next one."""
        return self._config.home / "logs" / f"rapp-{manifest.name}.log"

    def _take(self) -> Run:
        run, self._spare = self._spare, None
        if run is not None and not run.usable:
            _log.warning("the spare has died: %s", _tail(run))
            run.end(0.0)
            run = None
        run = run or self._start()
        if not run.wait_ready(self._config.warm_up):
            said = _tail(run)
            run.end(0.0)
            raise Bug(f"cannot start a dynamic agent: its process did not become ready; it said: {said}")
        return run

    def _start(self) -> Run:
        folders = RunFolders(self._runs / secrets.token_hex(6), _account())
        folders.make()
        with ExitStack() as undo:
            undo.callback(shutil.rmtree, folders.root, ignore_errors=True)
            ours, theirs = socket.socketpair()
            undo.callback(ours.close)
            theirs.setblocking(True)  # rospy sets a default time-out for new sockets, and the flag behind it would be inherited
            gates, runners = socket.socketpair()
            with theirs, gates, runners, folders.log.open("wb") as log:
                gate = Gate(self._ros["ROS_MASTER_URI"], self._node(folders.root.name), gates)
                undo.callback(gate.end)
                passed = (theirs.fileno(), runners.fileno())
                words = command(folders, self._config.limits, self._environment(*passed))
                process = Confined(words, passed, log.fileno(), folders.account)
            undo.pop_all()
        orphans.note(folders.root, process.pid)
        return Run(folders.root.name, folders, process, Channel(ours), gate)

    @property
    def _namespace(self) -> str:
        return self._ros.get("ROS_NAMESPACE", "")

    def _node(self, run: str) -> str:
        """What a run is called in the robot's ROS, whatever it calls itself."""
        return "/".join(["", *filter(None, self._namespace.split("/")), f"dynamic_agent_{run}"])

    def _environment(self, channel: int, gate: int) -> dict[str, str]:
        return {
            **({"ROS_NAMESPACE": self._namespace} if self._namespace else {}),
            "ROS_MASTER_URI": INSIDE_MASTER,
            "ROS_IP": "127.0.0.1",
            "RAPP_CHANNEL_FD": str(channel),
            "RAPP_GATE_FD": str(gate),
            "RAPP_WARM": runtime_at_hand(self._config.home),
            "HOME": INSIDE_PRIVATE,
            "TMPDIR": INSIDE_PRIVATE,
            "ROS_HOME": INSIDE_PRIVATE,
            "ROS_LOG_DIR": INSIDE_PRIVATE,
            "PATH": "/usr/bin:/bin",
            "LANG": "C.UTF-8",
            "MALLOC_ARENA_MAX": "2",  # each arena takes 64 MB of the limit on address space, whether used or not
            "PYTHONDONTWRITEBYTECODE": "1",
        }

    def close(self) -> None:
        """End the spare, give the data folder free."""
        self._discard_spare()
        self._unlock()

    def _discard_spare(self) -> None:
        run, self._spare = self._spare, None
        if run is not None:
            run.end(0.0)  # it has done nothing yet that it could tidy up

    def _unlock(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def _account() -> int | None:
    """User id for one run: of its own, so that limits on processes bind and runs cannot touch each other; needs root.

    Taken from 65000 to 65499, which Debian reserves (policy section 9.2.2).
    """
    return 65000 + secrets.randbelow(500) if os.geteuid() == 0 else None


def _copy(package: Path, folder: Path) -> None:
    """Copy a package for a run, readable for whoever runs it, without following links."""
    shutil.copytree(package, folder, symlinks=True, dirs_exist_ok=True)
    for path in (folder, *folder.rglob("*")):
        if not path.is_symlink():
            path.chmod(0o755 if path.is_dir() else 0o644)


def _tail(run: Run) -> str:
    """How a process ended, and the end of what it printed."""
    text = run.folders.log.read_text(errors="replace")[-2000:] if run.folders.log.exists() else ""
    return f"(status {run.status}) {text}"
