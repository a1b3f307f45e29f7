"""Packages on their way to the disk, and parts of them that a later download goes on from.

A file is named after version and hash of its package, which is checked over the whole, however many lines it came by. Each
RApp has one at most; one that nobody goes on with is removed after `KEPT`.
"""

import re
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from rapp_hop.hz.attacks import Away

KEPT = 86400.0  # seconds
_FORM = re.compile(r"([a-z][a-z0-9_]*)~([0-9A-Za-z.+-]+)~[0-9a-f]+\.part", re.ASCII)


class Downloads:
    """The folder of downloads. Blocking; one writer for each RApp."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def file(self, name: str, version: str, digest: str) -> Path:
        """Return the file for a package, of which a part may be there; those of its other versions go."""
        self._folder.mkdir(parents=True, exist_ok=True)
        mine = self._folder / f"{name}~{version}~{digest[:32]}.part"
        self.remove(name, mine)
        return mine

    def remove(self, name: str, but: Path | None = None) -> None:
        """Remove what has come of a RApp's packages, but not one of the files."""
        for path in self._folder.glob(f"{name}~*"):
            if path != but:
                path.unlink(missing_ok=True)

    def parts(self) -> dict[Path, str]:
        """Return what is there, the oldest first, and the RApp that it belongs to."""
        found = self._folder.iterdir() if self._folder.is_dir() else iter(())
        return {path: path.name.partition("~")[0] for path in sorted(found, key=_age)}

    def tidy(self, installed: Callable[[str, str], object]) -> None:
        """Remove what no download will go on from: parts older than `KEPT` or of what is installed, and what is no part.

        :param installed: tells of a name and a version
        """
        for path in self.parts():
            form = _FORM.fullmatch(path.name)
            if form is None or abs(time.time() - _age(path)) > KEPT or installed(form[1], form[2]):
                path.unlink(missing_ok=True)


@contextmanager
def partial(part: Path | None, length: int) -> Iterator[IO[bytes]]:
    """Open a file to append what comes of a download; None: a nameless one.

    What is wrong does not stay; a part does when the line is to blame for the end.

    :param length: bytes; a part that is longer is begun anew
    """
    if part is None:
        with tempfile.TemporaryFile() as nameless:
            yield nameless
        return
    try:
        with part.open("a+b") as file:
            if file.tell() > length:
                file.truncate(0)
            yield file
    except BaseException as error:
        if not isinstance(error, Away) or not part.stat().st_size:
            part.unlink(missing_ok=True)
        raise


def _age(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except FileNotFoundError:
        return 0.0
