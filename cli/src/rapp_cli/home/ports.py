"""The ports of a home's agents: chosen once and kept, so that an agent that is started again is found where it was."""

import random
import socket
from collections.abc import Mapping
from pathlib import Path

from rapp_cli.errors import CommandError, UsageError

USUAL = {"roscore": 11311, "nao_sim": 9559, "rosbridge": 9090, "cloud": 9001, "mail": 2525}
"""The ports people expect; taken when they are free."""

LOWEST = 20_000
RANGE = Path("/proc/sys/net/ipv4/ip_local_port_range")


def choose(kept: Mapping[str, int], wished: Mapping[str, int]) -> dict[str, int]:
    """A free port for every agent: the one wished for, else the one kept, else the usual one, else any.

    Raises UsageError when a wished one is used by something else or wished for twice.
    """
    chosen: dict[str, int] = {}
    for agent, port in wished.items():
        if port in chosen.values() or not is_free(port):
            raise UsageError(f"cannot use port {port} for {agent}: it is taken; give another --{agent.replace('_', '-')}-port")
        chosen[agent] = port
    for agent, usual in USUAL.items():
        if agent not in chosen:
            candidates = [kept.get(agent, usual), usual]
            found = next((port for port in candidates if port not in chosen.values() and is_free(port)), None)
            chosen[agent] = found or _any(set(chosen.values()))
    return chosen


def is_free(port: int) -> bool:
    """Whether a server on this computer could listen on the port."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
    return True


def is_served(port: int) -> bool:
    """Whether something on this computer listens on the port."""
    with socket.socket() as probe:
        probe.settimeout(1.0)
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _any(taken: set[int]) -> int:
    """A free port below those that the kernel gives to outgoing connections: while an agent is away, nobody takes it."""
    highest = max(int(RANGE.read_text().split()[0]) if RANGE.exists() else 32_768, LOWEST + 1000)
    for port in random.sample(range(LOWEST, highest), 200):
        if port not in taken and is_free(port):
            return port
    raise CommandError("cannot find a free port; end some servers, or give the --...-port options")
