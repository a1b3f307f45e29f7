"""Reports of runs on the disk until the platform has them. Blocking.

A report's name is the hash of its content: kept twice it is one file, and one that was sent is remembered, so nothing is
sent twice. (A power cut between the platform's answer and our note sends it again; the platform knows it by its run.)
"""

import hashlib
from pathlib import Path
from typing import Any

from rapp_hop import strict_json
from rapp_hop.errors import Invalid, Refused
from rapp_link.disk import Disk, new_aside, replace_whole, sweep

KEPT, REMEMBERED = 500, 500  # reports waiting, and sent ones remembered
MAX_REPORT = 256 * 2**10  # bytes


class Reports:
    """The reports of this robot."""

    def __init__(self, folder: Path, disk: Disk | None = None) -> None:
        """Open or make the folder.

        :raises Refused: the disk refuses
        """
        self._folder = folder
        self._disk = disk or Disk()
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            sweep(self._disk, folder)
        except OSError as error:
            raise Refused(f"cannot keep reports in {folder}: {error.strerror}, check the folder") from None

    def keep(self, run: dict[str, Any]) -> bool:
        """Keep a report; false when the platform has it already. Beyond `KEPT` the oldest is forgotten.

        :raises Refused: the disk refuses
        """
        text = strict_json.dumps(run).encode()
        if len(text) > MAX_REPORT:
            raise Refused(f"cannot keep a report of {len(text)} bytes: at most {MAX_REPORT} are allowed")
        path = self._folder / f"{hashlib.sha256(text).hexdigest()}.json"
        try:
            if path.with_suffix(".sent").exists():
                return False
            if not path.exists():
                replace_whole(self._disk, path, text)
            self._trim("*.json", KEPT)
        except OSError as error:
            raise Refused(f"cannot keep a report in {self._folder}: {error.strerror}, free some space") from None
        return True

    def waiting(self) -> list[Path]:
        """Return the reports to send, oldest first."""
        return self._by_age("*.json")

    def read(self, path: Path) -> dict[str, Any]:
        """Return a report.

        :raises Invalid: damaged
        """
        try:
            run = strict_json.loads(path.read_bytes(), limit=MAX_REPORT)
        except OSError as error:
            raise Invalid(f"cannot read {path}: {error.strerror}") from None
        if not isinstance(run, dict):
            raise Invalid(f"cannot read {path}: it is no report")
        return run

    def done(self, path: Path) -> None:
        """Forget a report's content and remember that it is done.

        :raises Refused: the disk refuses
        """
        try:
            aside = new_aside(self._folder)
            self._disk.write(aside, b"")
            self._disk.rename(aside, path.with_suffix(".sent"))
            self._disk.remove(path)
            self._trim("*.sent", REMEMBERED)
        except OSError as error:
            raise Refused(f"cannot note a report in {self._folder}: {error.strerror}, check the folder") from None

    def _by_age(self, pattern: str) -> list[Path]:
        return sorted(self._folder.glob(pattern), key=lambda path: path.stat().st_mtime_ns)

    def _trim(self, pattern: str, most: int) -> None:
        found = self._by_age(pattern)
        for path in found[: max(0, len(found) - most)]:
            self._disk.remove(path)
