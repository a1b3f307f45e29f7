"""The wall between what the platform promises of cloud agents and what runs them: processes here, containers elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from rapp_hop.protocol import WireAnswer, WireRequest


@dataclass(frozen=True)
class Order:
    """What to run, and for whom."""

    robot: str
    run: str  # of the robot's core agent
    name: str  # of the package
    package: Path  # unpacked folder; the engine copies it
    entry: str  # path of the program in the package
    parameters: Mapping[str, Any]  # of the package
    services: frozenset[str]  # of a_rep that it may call


class CloudAgent(Protocol):
    """One running cloud agent."""

    @property
    def problem(self) -> str:
        """What is wrong with it, such as "it has crashed"; empty while all is well."""

    async def send(self, request: WireRequest, path: str, timeout: float) -> WireAnswer:
        """Pass a request on to its HOP server as it came, with another path.

        :param timeout: seconds
        :raises Unreachable: it does not answer, or ended meanwhile
        """

    async def stop(self) -> None:
        """End all its processes: SIGTERM, a bound, SIGKILL; returns when none is left. Again is fine."""


class CloudAgentEngine(Protocol):
    """Starts cloud agents; `open` is undone by `close`."""

    async def open(self) -> None:
        """Clear what an earlier platform left.

        :raises Refused: another platform uses the folder
        """

    async def prepare(self) -> None:
        """Make the next start quick; a failure is only logged."""

    async def start(self, order: Order) -> CloudAgent:
        """Run a package as cloud agent; returns when it serves.

        :raises Refused: it cannot be confined here, for the reason told
        :raises Bug: the program fails at its start
        :raises Unreachable: it is not ready in time
        """

    async def check(self) -> None:
        """Look after what the kernel's limits do not bind; called every second or so."""

    async def close(self) -> None:
        """End all agents."""
