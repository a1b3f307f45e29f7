"""Keeps one confined child warm, and turns it into a dynamic agent on demand (DESIGN section 3.6)."""

import json
import logging
import os
import secrets
import shutil
import socket
import subprocess
import threading
from pathlib import Path
from typing import Any

from rapp_core.config import Config
from rapp_core.errors import Bug, Invalid, Unreachable
from rapp_core.launcher.channel import Channel
from rapp_core.launcher.run import Run, Told
from rapp_core.launcher.sandbox import RunFolders, command

_log = logging.getLogger(__name__)
WARM_UP = 20.0  # s for a spare to import rospy and join ROS


class Launcher:
    """Starts, hands out and ends dynamic agents. `prepare` is undone by `close`."""

    def __init__(self, config: Config, ros: dict[str, str]) -> None:
        self._config = config
        self._ros = ros
        self._runs = config.home / "runs"
        self._lock = threading.Lock()
        self._spare: Run | None = None
        self._closed = False

    def clear_orphans(self) -> None:
        """Remove what an earlier core agent left; its processes died with it (bubblewrap's --die-with-parent)."""
        shutil.rmtree(self._runs, ignore_errors=True)
        self._runs.mkdir(parents=True)

    def prepare(self) -> None:
        """Start a spare in the background, unless there is one."""
        threading.Thread(target=self._prepare, name="spare", daemon=True).start()

    def _prepare(self) -> None:
        try:
            with self._lock:
                if not self._closed and (self._spare is None or not self._spare.alive):
                    self._spare = self._start()
        except Bug as error:
            _log.error("%s", error)

    def activate(self, package: Path, told: Told) -> Run:
        """Run the package as a dynamic agent; gives its run. Raises Invalid, Unreachable, Bug."""
        entry, parameters = _manifest(package)
        run = self._take()
        try:
            shutil.copytree(package, run.folders.package, dirs_exist_ok=True)
            run.activate(secrets.token_urlsafe(32), entry, parameters, told)
        except (OSError, Unreachable) as error:
            run.end(self._config.terminate)
            raise Unreachable(f"cannot start {package.name}: {error}") from error
        return run

    def _take(self) -> Run:
        with self._lock:
            run, self._spare = self._spare, None
            if run is None or not run.alive:
                run = self._start()
        if not run.ready.wait(WARM_UP) or not run.alive:
            tail = self._log_tail(run)
            run.end(self._config.terminate)
            raise Bug(f"cannot start a dynamic agent: its process did not become ready; it said: {tail}")
        return run

    def _start(self) -> Run:
        name = secrets.token_hex(6)
        folders = RunFolders(self._runs / name)
        folders.make()
        ours, theirs = socket.socketpair()
        environment = {
            **self._ros,
            "RAPP_CHANNEL_FD": str(theirs.fileno()),
            "HOME": "/rapp/private",
            "TMPDIR": "/rapp/private",
            "ROS_HOME": "/rapp/private/ros",
            "ROS_LOG_DIR": "/rapp/private/ros/log",
            "PATH": "/usr/bin:/bin",
            "LANG": "C.UTF-8",
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        words = command(folders, self._config.limits, environment)
        with (folders.root / "agent.log").open("wb") as log, theirs:
            try:
                process = subprocess.Popen(
                    words,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=log,
                    pass_fds=(theirs.fileno(),),
                    start_new_session=True,
                    env={"PATH": os.environ.get("PATH", "/usr/bin:/bin")},
                )
            except OSError as error:
                raise Bug(f"cannot start the sandbox: {error}; is bubblewrap installed?") from error
        return Run(name, folders, process, Channel(ours))

    @staticmethod
    def _log_tail(run: Run) -> str:
        log = run.folders.root / "agent.log"
        return log.read_text(errors="replace")[-2000:] if log.exists() else ""

    def close(self) -> None:
        """End the spare, and start no more."""
        with self._lock:
            self._closed = True
            run, self._spare = self._spare, None
        if run is not None:
            run.end(self._config.terminate)


def _manifest(package: Path) -> tuple[str, dict[str, Any]]:
    """Entry and parameters of an installed package. Raises Invalid."""
    try:
        rapp = json.loads((package / "package.json").read_text())["rapp"]
        entry, parameters = rapp["entry"], rapp.get("parameters", {})
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise Invalid(f"cannot run {package}: its package.json cannot be used ({error}); install it anew") from error
    if not isinstance(entry, str) or not (package / entry).resolve().is_relative_to(package.resolve()):
        raise Invalid(f"cannot run {package}: its entry {entry!r} lies outside of it")
    if not isinstance(parameters, dict):
        raise Invalid(f"cannot run {package}: its parameters are no object")
    return entry, parameters
