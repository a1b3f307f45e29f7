"""The cloud agents of this robot's runs: their addresses stay here, the core agent knows each by its run's name (DESIGN §1).

The core agent says again and again which runs live. An agent whose run is not named any more is stopped, for then the core agent
was killed, or stopping was never asked for. What this process does not know, because it was started anew, the platform tells.
"""

import asyncio
import logging
from typing import Any

from rapp_hop.errors import HopError, Invalid, Refused
from rapp_link.cloud_side import Platform

SILENCE = 15.0  # seconds without word of a run, after which it is over
LOOK = 1.0  # seconds between two looks
PATIENCE = 5.0  # seconds for a call of this process's own

_log = logging.getLogger(__name__)


class CloudAgents:
    """Starts, finds and stops; `run` looks after those that nobody wants any more. All in one loop."""

    def __init__(self, platform: Platform) -> None:
        """Know none yet."""
        self._platform = platform
        self._agents: dict[str, str] = {}  # by run
        self._heard: dict[str, float] = {}  # of runs that may have one; seconds of the loop's clock
        self._one = asyncio.Lock()  # who stops waits for who starts
        self._asked = False  # whether the platform has told what an earlier process left

    async def start(self, rapp: str, version: str, run: str, patience: float) -> str:
        """Start the cloud agent of a RApp for a run; return the name by which to call it.

        :param patience: seconds
        :raises HopError: what the platform says
        """
        self._heard[run] = asyncio.get_running_loop().time()  # from now on there may be one, whatever becomes of the answer
        async with self._one:
            answer = await self._platform.call("start_cloud_agent", {"rapp": rapp, "version": version, "run": run}, patience)
        if not isinstance(answer, dict) or not isinstance(answer.get("agent"), str):
            raise Invalid("cannot start a cloud agent: the platform's answer is none")
        self._agents[run] = answer["agent"]
        return run

    async def stop(self, run: str, patience: float) -> bool:
        """Stop the cloud agent of a run; false when there was none.

        :raises HopError: what the platform says; it is tried again later
        """
        stopped = False
        async with self._one:
            agent = await self._find(run, patience)
            if agent is not None:
                answer = await self._platform.call("stop_cloud_agent", {"agent": agent}, patience)
                stopped = isinstance(answer, dict) and bool(answer.get("stopped"))
        self._agents.pop(run, None)
        self._heard.pop(run, None)
        return stopped

    async def address(self, run: str, patience: float) -> str:
        """Return the first part of the URLs of a run's cloud agent, for `Platform.call`.

        :raises Refused: the run has none
        """
        agent = await self._find(run, patience)
        if agent is None:
            raise Refused("cannot call the cloud agent: this run has none, or it has ended")
        return f"agents/{agent}"

    def keep(self, run: str) -> None:
        """Take the core agent's word that a run lives; an empty one: none does."""
        if not run:
            self._heard = dict.fromkeys(self._heard, float("-inf"))
        elif run in self._heard:
            self._heard[run] = asyncio.get_running_loop().time()

    async def run(self) -> None:
        """Stop agents of runs that are over, until cancelled."""
        while True:
            await asyncio.sleep(LOOK)
            try:
                if not self._asked and self._platform.reachable:
                    await self._ask(PATIENCE)
                    self._asked = True
                await self._stop_forgotten()
            except HopError as error:
                _log.warning("%s", error)

    async def _stop_forgotten(self) -> None:
        now = asyncio.get_running_loop().time()
        for run in [run for run, heard in self._heard.items() if now - heard > SILENCE]:
            _log.warning("run %s is over: its cloud agent is stopped", run)
            self._heard[run] = now  # if this fails, it is tried again after another silence
            await self.stop(run, PATIENCE)

    async def _find(self, run: str, patience: float) -> str | None:
        if run not in self._agents:
            await self._ask(patience)
        return self._agents.get(run)

    async def _ask(self, patience: float) -> None:
        """Take over what the platform knows of this robot's agents."""
        answer = await self._platform.call("list_cloud_agents", {}, patience)
        for run, agent in _listed(answer).items():
            self._agents[run] = agent
            self._heard.setdefault(run, asyncio.get_running_loop().time())


def _listed(answer: Any) -> dict[str, str]:
    try:
        return {str(each["run"]): str(each["agent"]) for each in answer["agents"]}
    except (TypeError, KeyError):
        raise Invalid("cannot list the cloud agents: the platform's answer is no list") from None
