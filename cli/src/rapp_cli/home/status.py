"""`./rapp status`: every agent, its state and since when; the core agent's FSM; the running RApp; the platform; waiting mails."""

import argparse
import asyncio
import json
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from rapp_cli.home import platform
from rapp_cli.home.agents import CORE, RECORDER
from rapp_cli.home.place import Home, add_home_option, home_of
from rapp_cli.home.supervisor import Process, Supervisor, process_state
from rapp_cli.timeline import Entry, backwards
from rapp_core.config import Config
from rapp_core.control.quarantine import Entry as Failing
from rapp_core.control.quarantine import Quarantine
from rapp_hop.errors import Invalid
from rapp_hop.hz.install import RappFolder
from rapp_link.letter import from_json

ALL_RUN, SOMETHING_DOES_NOT, NOTHING_IS_UP = 0, 1, 3
PATIENCE = 1.5  # s for the link's sign of life
RUNS_A_RAPP = ("s7", "s8", "s9", "s10")  # states of the core FSM
CLOUD_AGENT_RUNS = "link->core reply start_cloud_agent"


@dataclass(frozen=True)
class State:
    """Where an FSM is."""

    state: str
    name: str
    since: float  # s since 1970


@dataclass(frozen=True)
class Status:
    """All that the command tells."""

    agents: Sequence[Process]
    core: State | None  # None: not known
    rapp: str | None  # name of the RApp that runs
    registered: bool | None  # with the platform; None: not known, as the link or the rosbridge does not answer
    mails_waiting: int
    installed: Mapping[str, str] = field(default_factory=dict)  # versions of the RApps on the robot
    cloud_agent: str | None = None  # name of its package, when the running RApp has one at the home's own platform
    quarantine: Mapping[str, Failing] = field(default_factory=dict)  # RApps that keep failing, and are not started for a while
    mails_undelivered: Mapping[str, Mapping[str, str]] = field(default_factory=dict)  # file: recipient: the server's words
    dynamic_agent: State | None = None  # where the RApp that runs is; None: none runs, or it has told nothing yet
    cloud_agent_since: float | None = None  # s since 1970


@dataclass(frozen=True)
class Told:
    """What the agents have told of where they are."""

    core: State | None = None
    dynamic: State | None = None
    cloud_agent_since: float | None = None


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp status`."""
    parser.description = "Shows what runs. Exit status: 0 all agents run, 1 one of them does not, 3 nothing is up."
    parser.add_argument("--json", action="store_true", help="for programs; times are seconds since 1970")
    add_home_option(parser)


def run(options: argparse.Namespace) -> int:
    """Print the status; gives the exit status."""
    home = home_of(options)
    processes = Supervisor(home).processes()
    status = read(home, processes)
    print(json.dumps(asdict(status), indent=2) if options.json else text(home, status, time.time()))
    if not processes:
        return NOTHING_IS_UP
    return ALL_RUN if all(process.state == "RUNNING" for process in status.agents) else SOMETHING_DOES_NOT


def read(home: Home, processes: Mapping[str, Process]) -> Status:
    """Put together what supervisor, recorder, link and the robot's folders tell."""
    agents = [_frozen(process) for process in processes.values()]
    told = _told(backwards(home.timeline, ('"entered"', CLOUD_AGENT_RUNS)), processes)
    running = told.core is not None and told.core.state in RUNS_A_RAPP
    registered = asyncio.run(platform.registered(home.settled().bridge, PATIENCE)) if processes else None
    rapp, agent = (_rapp(folder) if running else None for folder in (home.robot / "runs", home.cloud / "agents" / "runs"))
    installed = {name: manifest.version.text for name, manifest in RappFolder(home.robot / "rapps").list().items()}
    failing = Quarantine(Config(home=home.robot)).present()
    waiting, undelivered = _mails(home.robot)
    return Status(
        agents, told.core, rapp, registered, waiting, installed, agent, failing, undelivered, told.dynamic, told.cloud_agent_since
    )


def _frozen(process: Process) -> Process:
    """A process that was stopped by a signal looks alive to its supervisor."""
    if process.pid is None or process_state(process.pid) != "T":
        return process
    return Process(process.name, "FROZEN", process.since, process.pid, "stopped by a signal; see kill -CONT")


def _told(entries: Iterable[Entry], processes: Mapping[str, Process]) -> Told:
    """The states entered last, unless the recorder or the core agent is not there, or has not been for long enough.

    :param entries: the last one first; they are taken back to the begin of the run
    """
    told = Told()
    if not all(name in processes and processes[name].runs for name in (CORE, RECORDER)):
        return told
    for entry in entries:
        if entry.time < processes[CORE].since:
            break
        state = State(entry.state, entry.detail, entry.time)
        if entry.agent == "core" and entry.kind == "entered" and "/" not in entry.state:
            told = replace(told, core=told.core or state)
            if entry.state not in RUNS_A_RAPP[1:]:
                break
        elif entry.agent == "dynamic" and entry.kind == "entered":
            told = replace(told, dynamic=told.dynamic or state)
        elif entry.detail.startswith(CLOUD_AGENT_RUNS):
            told = replace(told, cloud_agent_since=told.cloud_agent_since or entry.time)
    return told if told.core is not None and told.core.state in RUNS_A_RAPP else Told(told.core)


def _rapp(runs: Path) -> str | None:
    """The name in the package of the run that has one: a spare has none yet."""
    for manifest in sorted(runs.glob("*/package/package.json")):
        try:
            return str(json.loads(manifest.read_text())["name"])
        except (OSError, ValueError, KeyError, TypeError):
            continue  # it ended meanwhile
    return None


def _mails(robot: Path) -> tuple[int, dict[str, dict[str, str]]]:
    """How many wait, and those that were kept and then refused, as long as their content is there."""
    waiting, undelivered = 0, {}
    for path in sorted((robot / "link" / "outbox").glob("*/letter.json")):
        try:
            letter = from_json(path.read_bytes())
        except (OSError, Invalid):
            continue  # it was sent meanwhile, or the link itself complains of it
        waiting += letter.state == "queued"
        content = path.with_name("message.eml")
        if letter.undelivered and content.exists():
            undelivered[str(content)] = {name: letter.refused[name] for name in letter.undelivered}
    return waiting, undelivered


def text(home: Home, status: Status, now: float) -> str:
    """The status for people."""
    lines = [
        f"{process.name:<11} {process.state.lower():<9} since {_when(process.since, now):<28} "
        + (f"process {process.pid}" if process.pid else process.problem)
        for process in status.agents
    ] or [f"nothing is up; start it with {home.command('up')}"]
    if status.agents:
        lines += ["", f"core agent  {_where(status.core, now) or 'state not known'}"]
        lines += [f"RApp        {', '.join(filter(None, (status.rapp or 'none runs', _where(status.dynamic_agent, now))))}"]
        since = f", since {_when(status.cloud_agent_since, now)}" if status.cloud_agent_since else ""
        lines += [f"cloud agent {status.cloud_agent}{since}"] if status.cloud_agent else []
        standing = {True: "registered", False: "not registered: it is away", None: "not known: the link does not answer"}
        lines += [f"platform    {standing[status.registered]}"]
    lines += [f"installed   {', '.join(f'{name} {version}' for name, version in status.installed.items()) or 'no RApp'}"]
    for name, entry in status.quarantine.items():
        until = time.strftime("%H:%M:%S", time.localtime(entry.until))
        lines += [f"quarantine  {name} {entry.version} until {until}: has failed {entry.failures} times in a row ({entry.why})"]
    lines += [f"mails       {status.mails_waiting} waiting to be sent"]
    for path, refused in status.mails_undelivered.items():
        words = "; ".join(f"{name}: {said}" for name, said in refused.items())
        lines += [f"not sent    to {words}; the mail is {path}, remove it when it is not needed any more"]
    return "\n".join(lines)


def _where(state: State | None, now: float) -> str:
    return f"{state.state} {state.name}, since {_when(state.since, now)}" if state else ""


def _when(moment: float, now: float) -> str:
    if not moment:
        return "never"
    format_ = "%H:%M:%S" if now - moment < 12 * 3600 else "%Y-%m-%d %H:%M:%S"
    return f"{time.strftime(format_, time.localtime(moment))} ({_span(max(0.0, now - moment))})"


def _span(seconds: float) -> str:
    for size, unit in ((86400, "d"), (3600, "h"), (60, "min")):
        if seconds >= size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"
