"""`./rapp up`: starts a robot and a cloud that stay, shows how they come up, returns when the robot listens."""

import argparse
import asyncio
import contextlib
import os
import signal
import time
from collections.abc import Mapping
from pathlib import Path

from tornado.websocket import WebSocketError

from rapp_cli import mail_account
from rapp_cli.cloud import CONTACTS, make_platform, own_rapps, write_profile
from rapp_cli.errors import CommandError, UsageError
from rapp_cli.home import platform
from rapp_cli.home.agents import CORE, Agent, agents, environment
from rapp_cli.home.place import Home, Settings, add_home_option, home_of
from rapp_cli.home.ports import USUAL, choose, is_served
from rapp_cli.home.supervisor import Process, Supervisor
from rapp_cli.timeline import follow
from rapp_cloud.app import open_shelf
from rapp_cloud.config import load_config
from rapp_cloud.keys import passphrase_from
from rapp_cloud.shelf import Shelf
from rapp_cloud.witness import noting_offers
from rapp_hop.errors import HopError
from rapp_hop.hz.archive import build

STEP = 0.1  # s between two looks
REGISTERS = 12.0  # s for the robot to register with its platform; it tries every 5 s
RECIPIENT = {"Elizabeth": "elizabeth@home.example"}
LISTENS = "s3"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp up`."""
    add_home_option(parser)
    parser.add_argument("--name", help="the robot's name at the platform (nao) [RAPP_ROBOT_NAME]")
    parser.add_argument("--timeout", type=float, default=90.0, help="seconds until the robot must listen (%(default)g)")
    for agent, port in USUAL.items():
        option = f"--{agent.replace('_', '-')}-port"
        parser.add_argument(option, type=_port, metavar="PORT", help=f"of {agent} (as before, or {port}, or any free one)")
    sim = parser.add_argument_group("the simulated robot")
    sim.add_argument("--microphone", choices=("sound", "text"), default="sound", help="what its ears hear (%(default)s)")
    sim.add_argument("--voice", choices=("espeak", "silent"), default="espeak", help="how it speaks (%(default)s)")
    sim.add_argument("--no-world", action="store_true", help="simulate voice and ears only, no body in a room")
    real = parser.add_argument_group("real equipment")
    real.add_argument("--robot", metavar="URL", help="NAOqi of a real NAO, such as tcp://nao.local:9559 [RAPP_ROBOT]")
    real.add_argument("--cloud", metavar="URL", help="a running platform [RAPP_CLOUD; RAPP_TOKEN_FILE, RAPP_ROOT_FILE]")
    mail_account.add_options(real)


def run(options: argparse.Namespace) -> int:
    """Bring everything up; 0 when the robot listens. What was started is ended again when it does not."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends like Ctrl-C
    home, supervisor = home_of(options), Supervisor(home_of(options))
    home.make()
    running = supervisor.runs()
    settings = read(options, os.environ, home.settings(), running=running)
    table, env = agents(home, settings), environment(home, settings, os.environ)
    if running:
        print("rapp up: it is up already", flush=True)
        asyncio.run(_Watch(home, settings, supervisor, table).until_it_listens(options.timeout))
    else:
        _prepare(home, settings)
        try:
            asyncio.run(_started(home, settings, supervisor, table, env, options.timeout))
        except BaseException:
            print("rapp up: ends what it has started", flush=True)
            supervisor.shut_down()
            raise
    _tell_what_next(home, settings)
    return 0


def read(options: argparse.Namespace, env: Mapping[str, str], kept: Settings | None, *, running: bool) -> Settings:
    """Settle what to run; raises UsageError when something else runs already, or a wish cannot be met."""
    wished = {agent: port for agent in USUAL if (port := getattr(options, f"{agent}_port")) is not None}
    simulator = ["--microphone", options.microphone, "--voice", options.voice, *(["--no-world"] if options.no_world else [])]
    before = kept.ports if kept else {}
    settings = Settings(
        name=options.name or env.get("RAPP_ROBOT_NAME") or "nao",
        robot=options.robot or env.get("RAPP_ROBOT") or None,
        cloud=options.cloud or env.get("RAPP_CLOUD") or None,
        mail=mail_account.read(options, env),
        simulator=tuple(simulator),
        ports={**before, **wished} if running else choose(before, wished),
    )
    if running and settings != kept:
        raise UsageError("cannot change what is up already: ./rapp down first, or ./rapp up with the options of before")
    return settings


def _prepare(home: Home, settings: Settings) -> None:
    """Make the platform, offer the RApps of the repository, keep the settings."""
    if settings.cloud is None:
        if not (home.cloud / "root.json").exists():
            write_profile(home.cloud, settings.name, {**RECIPIENT, **CONTACTS})
        make_platform(home.cloud, settings.name)
        shelf = open_shelf(home.cloud, passphrase_from(os.environ))
        with noting_offers(home.cloud, shelf, load_config(home.cloud, {}, os.environ).database):
            for folder in own_rapps():
                _offer(shelf, folder)
    home.keep(settings)


def _offer(shelf: Shelf, folder: Path) -> None:
    try:
        shelf.publish(build(folder))
    except (HopError, OSError) as error:
        print(f"rapp up: the store keeps what it has of {folder.name}: {error}", flush=True)


async def _started(
    home: Home, settings: Settings, supervisor: Supervisor, table: list[Agent], env: Mapping[str, str], timeout: float
) -> None:
    watch = _Watch(home, settings, supervisor, table)
    await asyncio.to_thread(supervisor.start, table, env)
    await watch.until_it_listens(timeout)


class _Watch:
    """Prints one line per agent as it becomes ready."""

    def __init__(self, home: Home, settings: Settings, supervisor: Supervisor, table: list[Agent]) -> None:
        self._home = home
        self._settings = settings
        self._supervisor = supervisor
        self._waiting = {agent.name: agent for agent in table}
        self._began = time.monotonic()
        self._logged = {agent.name: _size(home.log(agent.name)) for agent in table}
        self._served = supervisor.runs()  # before this command

    async def until_it_listens(self, timeout: float) -> None:
        """Wait for all agents, and for the core agent to listen. Raises CommandError, with the end of a log."""
        listening = asyncio.create_task(_until_core_listens(self._settings.bridge))
        try:
            async with asyncio.timeout(timeout):
                while self._waiting or not listening.done():
                    self._look(await asyncio.to_thread(self._supervisor.processes))
                    await asyncio.sleep(STEP)
        except TimeoutError:
            name = next(iter(self._waiting), CORE)
            what = f"get {name} ready" if self._waiting else "get the robot to listen"
            raise CommandError(f"cannot {what} within {timeout:g} s\n{tail(self._home.log(name))}") from None
        finally:
            listening.cancel()
        self._print("robot", "listens")
        await self._tell_of_platform()

    async def _tell_of_platform(self) -> None:
        """A robot whose platform is away listens all the same; a platform that is there is waited for."""
        deadline = time.monotonic() + REGISTERS
        while not (known := await platform.registered(self._settings.bridge, REGISTERS)) and time.monotonic() < deadline:
            await asyncio.sleep(STEP)
        self._print("platform", "registered" if known else "not registered: it is away; the robot goes on trying")

    def _look(self, processes: Mapping[str, Process]) -> None:
        for name, agent in list(self._waiting.items()):
            process = processes.get(name)
            if process is None:
                raise CommandError(f"cannot go on: the supervisor is gone\n{tail(self._home.log('supervisor'))}")
            if not process.runs:
                raise CommandError(f"cannot start {name}: {process.problem}\n{tail(self._home.log(name))}")
            if process.state == "RUNNING" and self._serves(agent):
                del self._waiting[name]
                self._print(name, f"ready, process {process.pid}")

    def _serves(self, agent: Agent) -> bool:
        if self._served:
            return True
        if agent.port is not None:
            return is_served(agent.port)
        log, before = self._home.log(agent.name), self._logged[agent.name]
        with contextlib.suppress(FileNotFoundError), log.open("rb") as lines:
            lines.seek(before)
            return any(line.startswith(b"READY ") for line in lines)
        return False

    def _print(self, name: str, what: str) -> None:
        print(f"{time.monotonic() - self._began:7.1f} s  {name:<10} {what}", flush=True)


async def _until_core_listens(bridge: str) -> None:
    while True:
        with contextlib.suppress(OSError, WebSocketError, TimeoutError):
            async for entry in follow(bridge):
                if entry.agent == "core" and entry.state == LISTENS:
                    return
        await asyncio.sleep(STEP)


def tail(log: Path, lines: int = 15) -> str:
    """The end of a log, headed by its path."""
    text = log.read_text(errors="replace") if log.exists() else ""
    return "\n".join([f"--- {log}", *text.splitlines()[-lines:]])


def _tell_what_next(home: Home, settings: Settings) -> None:
    commands = {"status": "shows what runs", "log": "shows what the agents write", "down": "ends it"}
    if settings.robot is None:
        commands = {"say e-mail": "speaks to it", "listen": "speaks to it by your microphone", **commands}
    else:
        print("rapp up: say “e-mail” to it")
    width = max(len(home.command(words)) for words in commands)
    for words, what in commands.items():
        print(f"  {home.command(words):<{width}}  {what}")
    if settings.cloud is None:
        print(f"rapp up: whom it serves, and whom they may write to: {home.command('cloud')} person --help")


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def _port(word: str) -> int:
    port = int(word)
    if not 0 < port < 65536:
        raise argparse.ArgumentTypeError(f"{port} is no port: give 1 to 65535")
    return port
