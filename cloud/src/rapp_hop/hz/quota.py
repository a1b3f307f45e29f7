"""A bound on what RApps and their downloads take of a robot's disk; the least recently used RApps go first.

Bytes are counted as a disk gives them out, in blocks. Never removed is what runs, what was used or installed within the
last `FRESH` seconds, and what is being installed. Nothing is removed in vain: when there cannot be room, all stays.
"""

import json
import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rapp_hop.errors import Refused
from rapp_hop.hz.archive import Contents
from rapp_hop.hz.downloads import Downloads
from rapp_hop.hz.install import RappFolder

FRESH = 60.0  # seconds between the installation of a RApp and its start, at most
BLOCK = 4096  # bytes
Claim = Callable[[int], None]  # makes room for so many bytes in all, or raises Refused
_log = logging.getLogger(__name__)


class Quota:
    """The bound of one robot. Blocking; safe between threads."""

    def __init__(self, limit: int, home: Path, folder: RappFolder, downloads: Downloads) -> None:
        """Prepare.

        :param limit: bytes; 0: no bound
        :param home: the robot's data folder, in which `runs/<run>/package` are the RApps that run
        """
        self.limit = limit
        self._home = home
        self._folder = folder
        self._downloads = downloads
        self._claims: dict[str, int] = {}
        self._lock = threading.Lock()

    @contextmanager
    def claim(self, name: str) -> Iterator[Claim]:
        """Give what makes room for the installation of a RApp; what it claims counts until the block ends."""
        try:
            yield lambda size: self._claim(name, size)
        finally:
            with self._lock:
                self._claims.pop(name, None)

    def _claim(self, name: str, size: int) -> None:
        if not self.limit:
            return
        if size > self.limit:
            allowed = f"{size} bytes are needed, {self.limit} are allowed for all RApps"
            raise Refused(f"cannot install {name}: {allowed}, start the link with a larger --quota")
        with self._lock:
            self._claims[name] = 0
            self._make_room(name, size)
            self._claims[name] = size

    def _make_room(self, name: str, size: int) -> None:
        rapps = {known: size_of(self._folder.root / known) for known in self._folder.names()}
        parts = {path: _size(path) for path, owner in self._downloads.parts().items() if owner not in self._claims}
        over = sum(rapps.values()) + sum(parts.values()) + sum(self._claims.values()) + size - self.limit
        last_used = {known: self._folder.last_used(known) for known in rapps}
        kept = {*self._claims, *running(self._home / "runs")}
        kept |= {known for known, when in last_used.items() if abs(time.time() - when) < FRESH}
        leaving = sorted(rapps.keys() - kept, key=lambda known: last_used[known])
        if over > sum(parts.values()) + sum(rapps[known] for known in leaving):
            raise Refused(
                f"cannot install {name}: {size} bytes are needed, {max(0, size - over)} of {self.limit} are free and what runs"
                " or is new stays, remove a RApp, try again later, or start the link with a larger --quota"
            )
        for path in parts:
            if over <= 0:
                return
            path.unlink(missing_ok=True)
            over -= parts[path]
        for known in leaving:
            if over <= 0:
                return
            _log.warning("%s goes, it was used least recently: room for %s is needed", known, name)
            self._folder.remove(known)
            over -= rapps[known]


def unpacked_size(contents: Contents) -> int:
    """Return the bytes that a package takes when it is unpacked."""
    return BLOCK + sum(BLOCK if member.folder else _blocks(member.size) for member in contents.members)


def size_of(folder: Path) -> int:
    """Return the bytes that a folder takes; what goes meanwhile takes none."""
    return BLOCK + sum(_size(path) for path in folder.rglob("*"))


def _size(path: Path) -> int:
    try:
        return BLOCK if path.is_dir() else _blocks(path.lstat().st_size)
    except FileNotFoundError:
        return 0


def _blocks(size: int) -> int:
    return -(-size // BLOCK) * BLOCK


def running(runs: Path) -> set[str]:
    """Return the names of the RApps that run: each run has a copy of its package."""
    found = set()
    for path in runs.glob("*/package/package.json"):
        try:
            found.add(str(json.loads(path.read_bytes())["name"]))
        except (OSError, ValueError, KeyError, TypeError):
            continue  # it ends or begins just now
    return found
