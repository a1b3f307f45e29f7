"""`./rapp log [agent]`: what the agents write, merged in the order of time, each line with its agent's name; follows."""

import argparse
import contextlib
import heapq
import re
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from rapp_cli.errors import UsageError
from rapp_cli.home.agents import agents
from rapp_cli.home.place import add_home_option, home_of

STEP = 0.25  # s between two looks
TAIL = 1 << 18  # bytes read from the end of each log at first
SUPERVISOR = "supervisor"
_TIME = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3}")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp log`."""
    parser.description = "Prints what the agents write, and follows it until Ctrl-C."
    parser.add_argument("agent", nargs="?", help="only this one (./rapp status lists them), or “supervisor”")
    parser.add_argument("-n", "--lines", type=int, default=20, metavar="LINES", help="of before (%(default)s)")
    parser.add_argument("--no-follow", action="store_true", help="end after the lines of before")
    add_home_option(parser)


def run(options: argparse.Namespace) -> int:
    """Print the logs; 0 when ended by Ctrl-C too. Raises UsageError for an agent that is not there."""
    home = home_of(options)
    names = [*(agent.name for agent in agents(home, home.settled())), SUPERVISOR]
    if options.agent is not None and options.agent not in names:
        raise UsageError(f"cannot find the agent {options.agent!r}: there are {', '.join(names)}")
    logs = [Log(name, home.log(name)) for name in ([options.agent] if options.agent else names)]
    width = max(len(log.name) for log in logs) if len(logs) > 1 else 0
    with contextlib.suppress(KeyboardInterrupt):
        _show(logs, options.lines, width, follow=not options.no_follow)
    return 0


def _show(logs: Sequence["Log"], count: int, width: int, *, follow: bool) -> None:
    lines = list(merged(logs))
    _print(lines[-count:] if count > 0 else [], width)
    while follow:
        time.sleep(STEP)
        _print(merged(logs), width)


def _print(lines: Iterator[tuple[str, str]] | Sequence[tuple[str, str]], width: int) -> None:
    for name, line in lines:
        sys.stdout.write(f"{name:<{width}} | {line}\n" if width else f"{line}\n")
    sys.stdout.flush()


class Log:
    """One agent's log, read on from where it was read before; a log that was put aside is read to its end first."""

    def __init__(self, name: str, path: Path) -> None:
        self.name = name
        self._path = path
        self._offset = max(0, _size(path) - TAIL)
        self._inode = _inode(path)
        self._rest = b""
        self._time = ""

    def fresh(self) -> Iterator[tuple[str, str, str]]:
        """New lines: the time they were written, the agent, the text. A line without a time has that of the one before."""
        for line in self._lines():
            text = line.decode(errors="replace")
            found = _TIME.match(text)
            self._time = found.group() if found else self._time
            yield self._time, self.name, text

    def _lines(self) -> list[bytes]:
        data = b""
        inode = _inode(self._path)
        if inode != self._inode:
            data = _from(self._path.with_name(self._path.name + ".1"), self._offset)
            self._offset, self._inode = 0, inode
        more = _from(self._path, self._offset)
        self._offset += len(more)
        *lines, self._rest = (self._rest + data + more).split(b"\n")
        return lines


def merged(logs: Sequence[Log]) -> Iterator[tuple[str, str]]:
    """The new lines of all logs in the order of their times: agent and text."""
    for _, name, line in heapq.merge(*(list(log.fresh()) for log in logs), key=lambda line: line[0]):
        yield name, line


def _from(path: Path, offset: int) -> bytes:
    try:
        with path.open("rb") as log:
            log.seek(offset)
            return log.read()
    except FileNotFoundError:
        return b""


def _size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def _inode(path: Path) -> int:
    try:
        return path.stat().st_ino
    except FileNotFoundError:
        return 0
