"""Cloud agents as local processes: one confined spare is kept warm, and becomes a cloud agent on demand."""

import asyncio
import fcntl
import logging
import os
import secrets
import shutil
from pathlib import Path

from rapp_cloud.cloud_agents.orphans import RUNS, Keeper, clear
from rapp_cloud.cloud_agents.port import Order
from rapp_cloud.cloud_agents.process import LocalAgent, Serve
from rapp_cloud.cloud_agents.sandbox import Folders, Limits
from rapp_cloud.cloud_agents.usage import usages
from rapp_hop.errors import HopError, Refused

ACCOUNTS = range(65500, 65534)  # user ids, when root starts them: reserved by Debian (policy 9.2.2), not used by robots' RApps

_log = logging.getLogger(__name__)


class LocalProcesses:
    """See `port.CloudAgentEngine`. Everything in the loop of the process's main thread (see `Confined`)."""

    def __init__(self, folder: Path, serve: Serve, limits: Limits | None = None) -> None:
        """Prepare.

        :param folder: holds a folder for each agent, and `logs`, what each package's last agent printed
        :param serve: serves a_rep's services to an agent
        """
        self._folder = folder
        self._serve = serve
        self._limits = limits or Limits()
        self._agents: set[LocalAgent] = set()  # the spare too
        self._spare: asyncio.Task[LocalAgent] | None = None
        self._lock: int | None = None
        self._name = secrets.token_hex(4)  # of this platform's life
        self._keeper: Keeper | None = None

    async def open(self) -> None:
        """See `port.CloudAgentEngine`."""
        runs = self._folder / RUNS
        runs.mkdir(parents=True, exist_ok=True, mode=0o700)
        self._lock = os.open(self._folder / ".lock", os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._lock)
            self._lock = None
            raise Refused(f"cannot use {self._folder}: another platform runs there, give this one its own --data") from None
        await asyncio.to_thread(clear, runs)

    async def prepare(self) -> None:
        """See `port.CloudAgentEngine`."""
        if self._spare is None or (self._spare.done() and not _is_warm(self._spare)):
            self._spare = asyncio.create_task(self._warm_up())

    async def start(self, order: Order) -> LocalAgent:
        """See `port.CloudAgentEngine`."""
        agent = await self._take()
        try:
            await asyncio.to_thread(_copy, order.package, agent.folders.package)
            await agent.activate(order, self._serve)
        except (OSError, shutil.Error) as error:
            await agent.stop()
            raise Refused(f"cannot start {order.name}: {error}, see the platform's disk") from None
        except BaseException:
            await agent.stop()
            raise
        return agent

    async def check(self) -> None:
        """See `port.CloudAgentEngine`."""
        self._agents = {agent for agent in self._agents if not agent.gone}
        agents = {agent.process.first: agent for agent in self._agents}
        if agents:
            for first, usage in (await asyncio.to_thread(usages, list(agents))).items():
                agents[first].take(usage)

    async def close(self) -> None:
        """See `port.CloudAgentEngine`."""
        if self._spare is not None:
            self._spare.cancel()
            await asyncio.gather(self._spare, return_exceptions=True)
        await asyncio.gather(*(agent.stop() for agent in list(self._agents)))
        if self._keeper is not None:
            await asyncio.to_thread(self._keeper.close)
            self._keeper = None
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    async def _take(self) -> LocalAgent:
        spare, self._spare = self._spare, None
        if spare is not None:
            try:
                agent = await spare
                if not agent.problem:
                    return agent
                await agent.stop()
            except HopError as error:
                _log.info("no spare: %s", error)
        return await self._warm()

    async def _warm_up(self) -> LocalAgent:
        try:
            return await self._warm()
        except HopError as error:
            _log.warning("%s", error)
            raise

    async def _warm(self) -> LocalAgent:
        if self._keeper is None:
            self._keeper = Keeper(self._folder, self._name)
        folders = Folders(self._folder / RUNS / f"{self._name}-{secrets.token_hex(6)}", self._account())
        agent = await LocalAgent.start(folders, self._limits)
        self._agents.add(agent)
        try:
            await agent.ready()
        except BaseException:
            await agent.stop()
            raise
        return agent

    def _account(self) -> int | None:
        """User id for one agent: of its own, so that the limit on processes binds; needs root."""
        if os.geteuid() != 0:
            return None
        taken = {agent.folders.account for agent in self._agents if not agent.gone}
        return next((number for number in ACCOUNTS if number not in taken), ACCOUNTS[-1])


def _is_warm(spare: asyncio.Task[LocalAgent]) -> bool:
    return not spare.cancelled() and spare.exception() is None and not spare.result().problem


def _copy(package: Path, folder: Path) -> None:
    """Copy a package for an agent, readable for whoever runs it, without following links."""
    shutil.copytree(package, folder, symlinks=True, dirs_exist_ok=True)
    for path in (folder, *folder.rglob("*")):
        if not path.is_symlink():
            path.chmod(0o755 if path.is_dir() else 0o644)
