"""supervisord (supervisord.org) watches over the agents: its configuration, its start, its control by XML-RPC, its end."""

import http.client
import os
import shlex
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rapp_cli.errors import CommandError
from rapp_cli.home.agents import Agent
from rapp_cli.home.place import Home
from rapp_cli.secrecy import SECRETS

STOP = 8  # s from SIGTERM to SIGKILL for an agent
CALL_TIMEOUT = STOP + 7.0  # s; the longest call waits for the end of one agent
START_TIMEOUT = 10.0  # s until the supervisor answers
STEP = 0.1  # s between two looks
RUNNING = ("STARTING", "RUNNING")

_HEAD = """\
; Written by ./rapp up; a change made here is lost at the next one.
[unix_http_server]
file=%(here)s/control.sock
chmod=0700

[rpcinterface:supervisor]
supervisor.rpcinterface_factory=supervisor.rpcinterface:make_main_rpcinterface

[supervisord]
pidfile=%(here)s/supervisord.pid
logfile=%(here)s/../logs/supervisor.log
logfile_maxbytes=1MB
logfile_backups=1
childlogdir=%(here)s
umask=077
"""

# setpriv: an agent outlives the supervisor by no more than its own end takes. Without stopasgroup: an agent ends its own
# children in its own order; what it leaves when it has to be killed is killed with its group. An agent that fails is
# started again after 1 s, 2 s, 3 s and so on, for days.
_PROGRAM = """
[program:{name}]
command=setpriv --pdeathsig TERM {words}
priority={priority}
autorestart=true
startsecs=1
startretries=1000
stopwaitsecs={stop}
killasgroup=true
redirect_stderr=true
stdout_logfile=%(here)s/../logs/{name}.log
stdout_logfile_maxbytes=5MB
stdout_logfile_backups=2
"""


@dataclass(frozen=True)
class Process:
    """What the supervisor knows of one agent."""

    name: str
    state: str  # of supervisord: STARTING, RUNNING, BACKOFF, STOPPING, STOPPED, EXITED, FATAL, UNKNOWN
    since: float  # s since 1970
    pid: int | None
    problem: str  # why it does not run

    @property
    def runs(self) -> bool:
        """Whether there is a process."""
        return self.state in RUNNING


def configuration(agents: Sequence[Agent]) -> str:
    """The supervisor's configuration file; the agents get its environment, each secret only who needs it."""
    text = _HEAD
    for priority, agent in enumerate(agents, start=1):
        words = shlex.join(agent.words).replace("%", "%%")
        text += _PROGRAM.format(name=agent.name, words=words, priority=priority, stop=STOP)
        withheld = ",".join(f'{name}=""' for name, owner in SECRETS.items() if agent.name != owner)
        text += f"environment={withheld}\n"
    return text


class Supervisor:
    """The supervisor of one home; it need not run."""

    def __init__(self, home: Home) -> None:
        self._home = home
        self._configuration = home.supervision / "supervisord.conf"
        self._server: Any = xmlrpc.client.ServerProxy("http://localhost/RPC2", transport=_Transport(home.socket)).supervisor

    def start(self, agents: Sequence[Agent], env: Mapping[str, str]) -> None:
        """Start it, and with it all agents. Raises CommandError."""
        self._configuration.write_text(configuration(agents))
        words = [sys.executable, "-m", "supervisor.supervisord", "-c", str(self._configuration)]
        begun = subprocess.run(
            words, env=dict(env), stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=30, check=False
        )
        if begun.returncode:
            raise CommandError(f"cannot start the supervisor: {begun.stderr.strip() or begun.stdout.strip()}")
        deadline = time.monotonic() + START_TIMEOUT
        while not self.runs():
            if time.monotonic() > deadline:
                raise CommandError(f"cannot reach the supervisor: it does not answer; see {self._home.log('supervisor')}")
            time.sleep(STEP)

    def runs(self) -> bool:
        """Whether it answers. Raises CommandError when it is there, but does not answer in time."""
        try:
            self._call("getState")
        except _AwayError:
            return False
        return True

    def processes(self) -> dict[str, Process]:
        """All agents, in the order of their start; none when the supervisor is away. Raises CommandError."""
        try:
            order = {item["name"]: item["process_prio"] for item in self._call("getAllConfigInfo")}
            found = self._call("getAllProcessInfo")
        except (_AwayError, xmlrpc.client.Fault):
            return {}
        return {item["name"]: _process(item) for item in sorted(found, key=lambda item: order[item["name"]])}

    def stop(self, agent: str) -> None:
        """End one agent; returns when it is reaped. Raises CommandError."""
        try:
            self._call("stopProcess", agent)
        except (_AwayError, xmlrpc.client.Fault):
            return  # it has ended already

    def shut_down(self) -> None:
        """End the supervisor, and whatever agents still run; returns when it is gone. Raises CommandError."""
        try:
            pid = self._call("getPID")
            self._call("shutdown")
        except (_AwayError, xmlrpc.client.Fault):
            return
        deadline = time.monotonic() + CALL_TIMEOUT
        while process_state(pid) not in (None, "Z"):
            if time.monotonic() > deadline:
                raise CommandError(f"cannot end the supervisor: process {pid} is still there; see kill")
            time.sleep(STEP)

    def kill(self) -> int | None:
        """Kill a supervisor that does not answer; its agents end by themselves. Gives its process id, None without one."""
        try:
            pid = int((self._home.supervision / "supervisord.pid").read_text())
            words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
        except (OSError, ValueError):
            return None
        if bytes(self._configuration) not in words:
            return None
        os.kill(pid, signal.SIGKILL)
        return pid

    def _call(self, question: str, *words: str) -> Any:
        try:
            return getattr(self._server, question)(*words)
        except TimeoutError:
            raise CommandError(f"cannot reach the supervisor: it does not answer; see {self._home.command('down')}") from None
        except (OSError, http.client.HTTPException) as error:
            raise _AwayError(str(error)) from error


def process_state(pid: int) -> str | None:
    """The kernel's letter for a process (R, S, T, Z, ...; proc(5)); None when there is none."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return None


class _AwayError(Exception):
    """There is no supervisor."""


def _process(item: Mapping[str, Any]) -> Process:
    state = str(item["statename"])
    since = item["start"] if state in RUNNING else item["stop"] or item["start"]
    problem = "" if state in RUNNING else str(item["spawnerr"] or f"it ended with status {item['exitstatus']}")
    return Process(str(item["name"]), state, float(since), int(item["pid"]) or None, problem)


class _Transport(xmlrpc.client.Transport):
    """XML-RPC over a UNIX socket, in bounded time."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path

    def make_connection(self, _host: Any) -> http.client.HTTPConnection:
        return _Connection(self._path)


class _Connection(http.client.HTTPConnection):
    def __init__(self, path: Path) -> None:
        super().__init__("localhost", timeout=CALL_TIMEOUT)
        self._path = path

    def connect(self) -> None:
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.settimeout(self.timeout)
        self.sock.connect(str(self._path))
