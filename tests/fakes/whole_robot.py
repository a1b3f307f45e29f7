"""A whole system for system tests: real robot, platform and mail server, each process of which can be killed, frozen, brought back.

The robot is simulated with a text-fed microphone and a silent voice, so that a story takes no longer than its waits; it has a body
in a room when it is wanted.
"""

import json
import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rapp_core.errors import CoreError
from rapp_core.robot.naoqi.connection import Connection
from rapp_core.robot_processes.child import Child

PATIENCE = 30.0  # s for anything that has to happen
AGAIN = 0.25  # s between two tries to be heard
NEVER = threading.Event()
ORDER = ("roscore", "mail", "cloud", "nao_sim", "rosbridge", "link", "core_agent")
WATCHER = """
import json, rospy
from rapp_msgs.msg import AgentState
from rapp_ros.rejoin import Rejoining
KINDS = ("entered", "left", "failed", "said", "heard", "message")
def tell(m):
    print(json.dumps([m.agent, m.machine, m.state, KINDS[m.kind], m.detail]), flush=True)
rospy.init_node("watcher", anonymous=True, disable_rosout=True)
rospy.Subscriber("/core_agent/state", AgentState, tell, queue_size=10_000)
rejoining = Rejoining()
print("READY {}", flush=True)
rospy.spin()
"""


@dataclass(frozen=True)
class Seen:
    """One thing the core agent has published, and when it came, on the monotonic clock."""

    time: float
    agent: str
    machine: str
    state: str
    kind: str
    detail: str


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class WholeRobot:
    """Start it with `start`, end it with `close`; `seen` is all that was published so far."""

    def __init__(
        self, folder: Path, publish: Iterable[Path] = (), profile: Mapping[str, Any] | None = None, body: bool = False
    ) -> None:
        self.folder, self.home, self.data = folder, folder / "robot", folder / "cloud"
        self.maildir = folder / "mail"
        self.logs = folder / "logs"
        self.settings = ""  # of the core agent, in TOML, beside its defaults
        self.failures = 1000  # in a row until a RApp is not started for a while: tests make them fail on purpose
        self.body = () if body else ("--no-world",)  # options of the simulator
        self.cloud_port = free_port()
        self.cloud_url = f"http://127.0.0.1:{self.cloud_port}"  # as the link reaches the platform
        self.mail_port = free_port()
        self.seen: list[Seen] = []
        self._publish, self._profile = list(publish), profile or {"name": "Maria", "language": "en", "contacts": []}
        self._ports = {name: free_port() for name in ("roscore", "nao_sim", "rosbridge")}
        self._children: dict[str, Child] = {}
        self._frozen: set[str] = set()
        self._new = threading.Condition()
        self._watcher: subprocess.Popen[str] | None = None
        self._connection: Connection | None = None

    # life

    def start(self, *names: str) -> None:
        """Start these processes, in the order in which they need each other; without names: all."""
        for name in names or ORDER:
            self._start(name)
            if name == "roscore" and self._watcher is None:
                self._watch()

    def _start(self, name: str) -> None:
        if name == "cloud" and not self.data.exists():
            self._make_platform()
        child = Child(name, self._words(name), self._environment(), self.logs / f"{name}-{time.monotonic_ns()}.log")
        self._children[name] = child
        if name == "roscore":
            child.wait_port(self._ports["roscore"], PATIENCE, NEVER)
        else:
            child.wait_ready(PATIENCE, NEVER)

    def _words(self, name: str) -> list[str]:
        run = [sys.executable, "-m"]
        home, data = str(self.home), str(self.data)
        if name == "core_agent":
            return [*run, "rapp_core", "--robot", self.robot_url, "--home", home, "--config", str(self._config())]
        return {
            "roscore": ["rosmaster", "--core", "-p", str(self._ports["roscore"])],
            "mail": [*run, "rapp_cloud.mail", "--port", str(self.mail_port), "--maildir", str(self.maildir)],
            "cloud": [*run, "rapp_cloud", "--port", str(self.cloud_port), "--data", data, *self._offered()],
            "nao_sim": [*run, "rapp_nao_sim", "--port", str(self._ports["nao_sim"]), "--files", home, *TEXT_FED, *self.body],
            "rosbridge": [*run, "rapp_bridge", "--port", str(self._ports["rosbridge"])],
            "link": [*run, "rapp_link", "--bridge", f"ws://127.0.0.1:{self._ports['rosbridge']}", "--cloud", self.cloud_url],
        }[name]

    def _offered(self) -> list[str]:
        return [word for folder in self._publish for word in ("--publish", str(folder))]

    def _config(self) -> Path:
        path = self.folder / "core_agent.toml"
        path.write_text(f"failures = {self.failures}\n{self.settings}")
        return path

    @property
    def ros(self) -> dict[str, str]:
        """Environment of a process that joins its ROS."""
        return {
            "ROS_MASTER_URI": f"http://127.0.0.1:{self._ports['roscore']}",
            "ROS_IP": "127.0.0.1",
            "ROS_LOG_DIR": str(self.logs / "ros"),
        }

    def _environment(self) -> dict[str, str]:
        self.home.mkdir(parents=True, exist_ok=True)
        return {
            **os.environ,
            **self.ros,
            "RAPP_HOME": str(self.home),
            "RAPP_TOKEN_FILE": str(self.data / "robots" / "nao.token"),
            "RAPP_ROOT_FILE": str(self.data / "root.json"),
            "RAPP_SMTP_HOST": "127.0.0.1",
            "RAPP_SMTP_PORT": str(self.mail_port),
            "RAPP_SMTP_SECURITY": "none",
            "RAPP_MAIL_FROM": "nao@home.example",
        }

    def _make_platform(self) -> None:
        words = [sys.executable, "-m", "rapp_cloud", "init", "--data", str(self.data), "--robot", "nao"]
        subprocess.run(words, check=True, timeout=PATIENCE, capture_output=True)
        (self.data / "profiles").mkdir(exist_ok=True)
        (self.data / "profiles" / "nao.json").write_text(json.dumps(self._profile))

    def close(self) -> None:
        """End everything, last started first."""
        self.thaw_all()
        if self._connection is not None:
            self._connection.close()
        while self._children:
            self._children.popitem()[1].end(PATIENCE)
        if self._watcher is not None:
            self._watcher.kill()
            self._watcher.communicate()

    # faults

    def pid(self, name: str) -> int:
        return self._children[name]._process.pid

    def stop(self, name: str) -> None:
        """End one process as its user would."""
        self._children.pop(name).end(PATIENCE)

    def kill(self, name: str) -> None:
        """SIGKILL to one process, not to its children; it is reaped."""
        child = self._children.pop(name)
        self._frozen.discard(name)
        child._process.kill()
        child.end(PATIENCE)

    def freeze(self, name: str) -> None:
        """SIGSTOP to a process and its group, as when a computer stands still."""
        self._frozen.add(name)
        os.killpg(self.pid(name), signal.SIGSTOP)

    def thaw(self, name: str) -> None:
        self._frozen.discard(name)
        with suppress(ProcessLookupError):
            os.killpg(self.pid(name), signal.SIGCONT)

    def thaw_all(self) -> None:
        for name in list(self._frozen):
            self.thaw(name)

    # the person, and what is seen

    @property
    def robot_url(self) -> str:
        return f"tcp://127.0.0.1:{self._ports['nao_sim']}"

    @property
    def naoqi(self) -> Connection:
        """NAOqi itself, past the core agent."""
        if self._connection is None:
            self._connection = Connection(self.robot_url, 20.0)
        return self._connection

    def room(self, method: str, *words: Any) -> Any:
        """Call a method of SimWorld; gives its result."""
        return self.naoqi.call("SimWorld", method, *words)

    def say(self, text: str) -> None:
        """The person says a text once."""
        self.room("micText", text)

    def say_until(self, text: str, wanted: Callable[[Seen], bool], since: int) -> Seen:
        """The person says a text again and again until something has happened."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            self.say(text)
            with suppress(AssertionError):
                return self.until(wanted, since, AGAIN)
        raise AssertionError(f"{text!r} was not heard\n{self.story(since)}")

    def ask(self, keyword: str, state: str = "s4") -> Seen:
        """The person says a keyword again and again until the core agent has entered `state`: it is deaf between two rounds."""
        since, deadline = len(self.seen), time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            with suppress(CoreError):
                self.say(keyword)
            with suppress(AssertionError):
                return self.until(entered(state), since, 1.0)
        raise AssertionError(f"{keyword!r} was not heard\n{self.story(since)}")

    def until(self, wanted: Callable[[Seen], bool], since: int = 0, seconds: float = PATIENCE) -> Seen:
        """Wait for something to be published, at or after index `since` of `seen`."""
        deadline = time.monotonic() + seconds
        at = since
        with self._new:
            while True:
                for seen in self.seen[at:]:
                    if wanted(seen):
                        return seen
                at = len(self.seen)
                if not self._new.wait(max(0.0, deadline - time.monotonic())) and time.monotonic() >= deadline:
                    break
        raise AssertionError(f"it did not happen in {seconds:g} s\n{self.story(since)}")

    def until_listening(self, since: int = 0, seconds: float = PATIENCE) -> Seen:
        """Wait until the core agent has entered s3."""
        return self.until(entered("s3"), since, seconds)

    def until_only_the_spare_runs(self) -> None:
        """Wait until nothing of any run is left but the warm spare."""
        deadline = time.monotonic() + PATIENCE
        while True:
            runs = list((self.home / "runs").iterdir())
            sandboxes = {words for words in processes_of(self.home / "runs") if words.startswith("bwrap")}
            gates = [words for words in processes_of(self.ros["ROS_MASTER_URI"]) if "rapp_core.gate" in words]
            if len(runs) <= 1 and len(sandboxes) <= 1 and len(gates) <= 1:
                return
            assert time.monotonic() < deadline, f"left running: {runs} {sandboxes} {gates}"
            time.sleep(0.1)

    def until_only_the_cloud_spare_runs(self) -> None:
        """Wait until no cloud agent is left at the platform but the warm spare."""
        deadline = time.monotonic() + PATIENCE
        runs = self.data / "agents" / "runs"
        while True:
            used = list(runs.glob("*/package/*"))
            sandboxes = {words for words in processes_of(runs) if words.startswith("bwrap")}
            if not used and len(sandboxes) <= 1:
                return
            assert time.monotonic() < deadline, f"left running: {used} {sandboxes}"
            time.sleep(0.1)

    def said(self, since: int = 0) -> list[str]:
        """What the robot has said."""
        return [seen.detail for seen in self.seen[since:] if seen.kind == "said"]

    def messages(self, since: int = 0) -> list[str]:
        """Messages between agents."""
        return [seen.detail for seen in self.seen[since:] if seen.kind == "message"]

    def story(self, since: int = 0) -> str:
        """What was seen, and the ends of all logs: which process did what."""
        lines = [f"{s.time:.2f} {s.agent} {s.state} {s.kind} {s.detail}" for s in self.seen[since:]]
        logs = [*sorted(self.logs.glob("*.log")), *sorted((self.home / "logs").glob("*.log"))]
        tails = ["\n".join([f"--- {log.name}", *log.read_text(errors="replace").splitlines()[-20:]]) for log in logs]
        return "\n".join([*lines[-60:], *tails])

    def _watch(self) -> None:
        words = [sys.executable, "-c", WATCHER]
        self._watcher = subprocess.Popen(words, env=self._environment(), stdout=subprocess.PIPE, text=True)
        ready: queue.Queue[None] = queue.Queue()
        threading.Thread(target=self._read, args=(ready,), name="watcher", daemon=True).start()
        ready.get(timeout=PATIENCE)

    def _read(self, ready: "queue.Queue[None]") -> None:
        assert self._watcher is not None
        for line in self._watcher.stdout or ():
            if line.startswith("["):
                with self._new:
                    self.seen.append(Seen(time.monotonic(), *json.loads(line)))
                    self._new.notify_all()
            elif line.startswith("READY"):
                ready.put(None)


TEXT_FED = ("--microphone", "text", "--voice", "silent")


def entered(state: str, agent: str = "core") -> Callable[[Seen], bool]:
    """Matches the entering of a state."""
    return lambda seen: (seen.agent, seen.state, seen.kind) == (agent, state, "entered")


def listening_after(moment: Seen) -> Callable[[Seen], bool]:
    """Matches the entering of s3 after a moment."""
    return lambda seen: entered("s3")(seen) and seen.time > moment.time


def running_of(folder: Path, but: Sequence[int] = ()) -> dict[int, str]:
    """Process ids and command lines of the running processes that name the folder."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # it may end meanwhile
            words = path.read_bytes().replace(b"\0", b" ").decode(errors="replace")
            if str(folder) in words and int(path.parent.name) not in (os.getpid(), *but):
                found[int(path.parent.name)] = words
    return found


def processes_of(folder: Path, but: Sequence[int] = ()) -> list[str]:
    """Command lines of the running processes that name the folder."""
    return list(running_of(folder, but).values())


@contextmanager
def whole_robot(robot: WholeRobot, *names: str) -> Iterator[WholeRobot]:
    """Start it, wait until it listens; at the end close it."""
    try:
        robot.start(*names)
        robot.until_listening()
        yield robot
    finally:
        robot.close()


def inside(runs: Path, program: str) -> int | None:
    """Process id of a program in the sandbox of a run that has a package (a spare has none yet), if there is one."""
    folders = [path.parent for path in runs.glob("*/package") if any(path.iterdir())]
    tops = {pid for folder in folders for pid in running_of(folder)}
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
    for pid in sorted(parents):
        with suppress(OSError):
            above, words = pid, Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
            while above not in tops and above in parents:
                above = parents[above]
            if above in tops and program in words:
                return pid
    return None
