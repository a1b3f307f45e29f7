"""What all processes of a sandbox use together: a limit of the kernel's binds each process by itself. Blocking, brief."""

import os
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

_TICK = os.sysconf("SC_CLK_TCK")  # per s
_PAGE = os.sysconf("SC_PAGE_SIZE")  # bytes


@dataclass(frozen=True)
class Usage:
    """A sum over processes."""

    memory: int = 0  # bytes, resident
    cpu: float = 0.0  # s, of processes that have ended too

    def __add__(self, other: "Usage") -> "Usage":
        return Usage(self.memory + other.memory, self.cpu + other.cpu)


def usages(first: Iterable[int]) -> dict[int, Usage]:
    """For each of these processes: the sum over it and all below it.

    Those of a process namespace are all below its first one, which takes in orphans (proc(5), pid_namespaces(7)).
    """
    children: dict[int, list[int]] = defaultdict(list)
    own: dict[int, Usage] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended meanwhile
        pid, parent = int(path.parent.name), int(fields[1])
        children[parent].append(pid)
        ticks = sum(map(int, fields[11:15]))  # utime, stime, and those of its children that were waited for
        own[pid] = Usage(int(fields[21]) * _PAGE, ticks / _TICK)
    return {pid: _sum(pid, children, own) for pid in first}


def _sum(pid: int, children: dict[int, list[int]], own: dict[int, Usage]) -> Usage:
    total, waiting = Usage(), [pid]
    while waiting:
        one = waiting.pop()
        total += own.get(one, Usage())
        waiting += children.pop(one, ())
    return total
