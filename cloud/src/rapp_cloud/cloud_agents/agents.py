"""Which cloud agents run, and for whom: started at a robot's word, ended at its word, with its lease, or when something is wrong.

The lease is the robot's registration, which its heartbeats renew: when a robot counts as gone, so are its agents.
"""

import asyncio
import contextlib
import logging
import secrets
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from rapp_cloud.cloud_agents.packages import Packages
from rapp_cloud.cloud_agents.port import CloudAgent, CloudAgentEngine, Order
from rapp_hop.errors import Refused, Unreachable
from rapp_hop.protocol import WireAnswer, WireRequest

FORBIDDEN = frozenset(
    {"register", "heartbeat", "report", "start_cloud_agent", "stop_cloud_agent", "list_cloud_agents"}
)  # what only the robot itself may say of itself: an agent must not keep its own lease
LOOK = 0.5  # s between two looks at all agents
LONGEST_RUN = 128  # characters
REMEMBERED = 256  # agents that have ended, so that a late caller is told why
CALLS = 16  # calls of one agent at a time

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Quota:
    """How many agents may run."""

    robot: int = 4  # of one robot
    all: int = 32


@dataclass
class _Entry:
    robot: str
    rapp: str
    run: str
    agent: CloudAgent
    calls: int = 0


class CloudAgents:
    """All of one platform; `open` is undone by `close`. For one loop."""

    def __init__(
        self, engine: CloudAgentEngine, packages: Packages, is_here: Callable[[str], bool], quota: Quota | None = None
    ) -> None:
        """Prepare.

        :param is_here: whether a robot's lease holds
        """
        self._engine = engine
        self._packages = packages
        self._is_here = is_here
        self._quota = quota or Quota()
        self._agents: dict[str, _Entry] = {}  # by id
        self._starting: dict[tuple[str, str], asyncio.Task[str]] = {}  # by robot and run
        self._ended: OrderedDict[str, tuple[str, str]] = OrderedDict()  # id to robot and reason
        self._watch: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Clear what an earlier platform left, and watch from now on."""
        await self._engine.open()
        await asyncio.to_thread(self._packages.open)
        if await asyncio.to_thread(self._packages.any):
            await self._engine.prepare()
        self._watch = asyncio.create_task(self._look_after())

    async def close(self) -> None:
        """End all agents."""
        tasks = [task for task in (self._watch, *self._starting.values()) if task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._agents.clear()
        await self._engine.close()

    async def start(self, robot: str, rapp: str, version: str, run: str) -> str:
        """Start the cloud agent of a RApp for one run; the same run again gives the same agent.

        :return: its id
        :raises HopError: see `CloudAgentEngine.start`; Refused too for a quota or without such a package
        """
        for agent, entry in self._agents.items():
            if (entry.robot, entry.run) == (robot, run):
                return agent
        if not 0 < len(run) <= LONGEST_RUN:
            raise Refused(f"cannot start a cloud agent for a run without a name, or with one of more than {LONGEST_RUN} characters")
        task = self._starting.get((robot, run))
        if task is None:
            self._check_quota(robot)
            task = self._starting[robot, run] = asyncio.create_task(self._start(robot, rapp, version, run))
            task.add_done_callback(lambda _: self._starting.pop((robot, run), None))
        return await asyncio.shield(task)

    async def stop(self, robot: str, agent: str) -> bool:
        """End one of a robot's agents; returns when nothing of it is left. False when there was none."""
        if agent not in self._agents or self._agents[agent].robot != robot:
            return False
        await self._end(agent, "it was stopped")
        return True

    def list(self, robot: str) -> list[dict[str, str]]:
        """Return the agents of a robot."""
        found = ((agent, entry) for agent, entry in self._agents.items() if entry.robot == robot)
        return [{"agent": agent, "rapp": entry.rapp, "run": entry.run} for agent, entry in found]

    def count(self) -> int:
        """Return how many run, of all robots."""
        return len(self._agents)

    async def send(self, robot: str, agent: str, request: WireRequest, path: str, timeout: float) -> WireAnswer:
        """Pass a call on to one of a robot's agents.

        :raises Refused: it is none of the robot's, or has ended (404)
        :raises Unreachable: it does not answer, or has too many calls (503)
        """
        entry = self._agents.get(agent)
        if entry is None or entry.robot != robot:
            owner, reason = self._ended.get(agent, ("", ""))
            why = f"it has ended, {reason}" if owner == robot else "this robot has none of that name"
            raise Refused(f"cannot call the cloud agent: {why}", 404)
        if entry.calls >= CALLS:
            raise Unreachable(f"cannot call the cloud agent of {entry.rapp} now: {CALLS} calls are open, try again later", 503)
        entry.calls += 1
        try:
            return await entry.agent.send(request, path, timeout)
        finally:
            entry.calls -= 1

    def _check_quota(self, robot: str) -> None:
        own = sum(entry.robot == robot for entry in self._agents.values()) + sum(key[0] == robot for key in self._starting)
        if own >= self._quota.robot:
            raise Refused(f"cannot start another cloud agent for {robot}: it has {own} already, stop one first")
        if len(self._agents) + len(self._starting) >= self._quota.all:
            raise Unreachable(f"cannot start a cloud agent now: the platform runs {self._quota.all} already, try again later", 503)

    async def _start(self, robot: str, rapp: str, version: str, run: str) -> str:
        manifest, package = await asyncio.to_thread(self._packages.find, rapp, version)
        forbidden = sorted(FORBIDDEN.intersection(manifest.permissions.cloud))
        if forbidden:
            raise Refused(f"cannot start {manifest.name}: no cloud agent may call {forbidden[0]}, correct its package.json")
        services = frozenset(manifest.permissions.cloud)
        order = Order(robot, run, manifest.name, package, manifest.entry, manifest.parameters, services)
        started = await self._engine.start(order)
        agent = secrets.token_urlsafe(18)
        self._agents[agent] = _Entry(robot, rapp, run, started)
        _log.info("cloud agent %s started for %s, run %s", manifest.name, robot, run)
        await self._engine.prepare()
        return agent

    async def _end(self, agent: str, reason: str) -> None:
        entry = self._agents.get(agent)
        if entry is None:
            return  # somebody else was quicker
        self._ended[agent] = (entry.robot, reason)
        if len(self._ended) > REMEMBERED:
            self._ended.popitem(last=False)
        await entry.agent.stop()
        if self._agents.pop(agent, None) is not None:
            _log.info("cloud agent of %s for %s, run %s, has ended: %s", entry.rapp, entry.robot, entry.run, reason)

    async def _look_after(self) -> None:
        while True:
            await asyncio.sleep(LOOK)
            with contextlib.suppress(OSError):
                await self._engine.check()
            wrong = {agent: reason for agent, entry in self._agents.items() if (reason := self._wrong(entry))}
            await asyncio.gather(*(self._end(agent, reason) for agent, reason in wrong.items()))

    def _wrong(self, entry: _Entry) -> str:
        return entry.agent.problem or ("" if self._is_here(entry.robot) else "its robot is silent")
