"""rapp_keep: files that a RApp leaves to the person; all else that it writes is in memory and ends with its run."""

import re
import threading
from pathlib import Path

from rapp_core.config import Config
from rapp_core.errors import Invalid, Refused, Unreachable
from rapp_core.files import aside_of, write_whole
from rapp_core.ports import Agent

BLOCK = 4096  # bytes that a file takes at least: many small ones count, too
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


class Keepsakes:
    """The files of each RApp, in a folder of its own below `keepsakes` of the robot's data folder."""

    def __init__(self, config: Config) -> None:
        self._folder = config.home / "keepsakes"
        self._limits = config.limits
        self._lock = threading.Lock()

    def keep(self, run: Agent, name: str, data: bytes) -> Path:
        """Keep a file, in place of the RApp's older one of that name; gives its path. Raises Invalid, Refused, Unreachable."""
        if not _NAME.fullmatch(name):
            raise Invalid(f"cannot keep {name[:64]!r}: name a file such as table.jpg, of letters, digits and ._-, at most 64")
        if run.manifest is None or not _NAME.fullmatch(run.manifest.name):
            raise Refused(f"cannot keep {name}: the RApp's own name is no name of a folder; correct its package.json")
        folder = self._folder / run.manifest.name
        try:
            with self._lock:
                folder.mkdir(parents=True, exist_ok=True)
                self._check_size(folder, name, len(data))
                return write_whole(folder / name, data)
        except OSError as error:
            raise Unreachable(f"cannot keep {name}: {error.strerror}; see the disk of {self._folder}") from error

    def _check_size(self, folder: Path, name: str, size: int) -> None:
        limits = self._limits
        if size > limits.kept_file:
            raise Refused(f"cannot keep {name}: it has {size} bytes, {limits.kept_file} are allowed; make it smaller")
        own = (folder / name, aside_of(folder / name))
        others = sum(_taken(file.stat().st_size) for file in folder.iterdir() if file not in own)
        if others + _taken(size) > limits.kept:
            raise Refused(f"cannot keep {name}: {folder} would have more than {limits.kept} bytes; use an older file's name again")


def _taken(size: int) -> int:
    return max(BLOCK, size)
