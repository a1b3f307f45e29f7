"""Versions of RApps that fail again and again: started again after a while only, each time a longer one.

Kept on disk, and read at each question, so that neither the core agent's end nor the robot's ends a quarantine. What ends it: a
success, another version, `./rapp retry`, or the end of its time, after which the next failure brings a longer one.
"""

import json
import logging
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import datetime

from rapp_core.config import Config
from rapp_core.files import write_whole

FILE = "quarantine.json"
LATEST = 2.0**36  # s since 1970: the year 4147
TEXT = 300  # characters kept of why it failed
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Entry:
    """How a version has failed in a row; times in s since 1970."""

    version: str
    failures: int
    since: float
    until: float
    why: str


class Quarantine:
    """By the RApp's name: one version of it at a time."""

    def __init__(self, config: Config, wall: Callable[[], float] = time.time) -> None:
        self._path = config.home / FILE
        self._config = config
        self._wall = wall

    def present(self) -> dict[str, Entry]:
        """Those not to be started now, by name; a clock that went back shows nothing, so it ends a quarantine."""
        now = self._wall()
        return {name: entry for name, entry in self._entries().items() if entry.since <= now < entry.until}

    def refusal(self, name: str, version: str) -> str | None:
        """What to say of a version that is not to be started now; None when it may be."""
        entry = self.present().get(name)
        if entry is None or entry.version != version:
            return None
        return f"{name.replace('_', ' ')} keeps failing, I will not start it before {_spoken(entry.until, self._wall())}"

    def failed(self, name: str, version: str, why: str) -> None:
        """It has failed, and nobody else is to blame."""
        config, entries, now = self._config, self._entries(), self._wall()
        entry = entries.get(name)
        failures = 1 + (entry.failures if entry is not None and entry.version == version else 0)
        more = failures - config.failures
        seconds = min(config.quarantine * 2.0 ** min(more, 64), config.quarantine_longest) if more >= 0 else 0.0
        entries[name] = Entry(version, failures, now, now + seconds, why[:TEXT])
        try:
            self._write(entries)
        except OSError as error:
            _log.warning("cannot keep which RApps fail: %s", error)
        if seconds:
            _log.warning("%s %s has failed %d times: not started for %.0f s", name, version, failures, seconds)

    def forget(self, name: str) -> bool:
        """It has come to its end, or somebody has seen to it; gives whether there was anything to forget. Raises OSError."""
        entries = self._entries()
        known = entries.pop(name, None) is not None
        if known:
            self._write(entries)
        return known

    def _entries(self) -> dict[str, Entry]:
        try:
            read = json.loads(self._path.read_text("utf-8"))
            return {
                str(name): Entry(
                    str(entry["version"]), int(entry["failures"]), _time(entry["since"]), _time(entry["until"]), str(entry["why"])
                )
                for name, entry in read.items()
            }
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, OverflowError, KeyError, TypeError, AttributeError) as error:
            _log.warning("cannot read %s: %r; no RApp is in quarantine", self._path, error)
            return {}

    def _write(self, entries: dict[str, Entry]) -> None:
        write_whole(self._path, json.dumps({name: asdict(entry) for name, entry in entries.items()}).encode())


def _time(value: float) -> float:
    if not math.isfinite(value) or abs(value) > LATEST:
        raise ValueError(f"{value} is no time")
    return float(value)


def _spoken(moment: float, now: float) -> str:
    """A time within a week, as the robot says it."""
    then = datetime.fromtimestamp(moment + 59)  # the first whole minute in which it is over
    days = (then.date() - datetime.fromtimestamp(now).date()).days
    return then.strftime({0: "%H:%M", 1: "tomorrow %H:%M"}.get(days, "%A %H:%M"))
