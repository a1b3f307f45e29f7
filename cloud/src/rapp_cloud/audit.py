"""Who published, downloaded and ran what, whose keys changed, who was let in or out: a log that is only added to.

Each entry is sealed with a key that lies outside the database, over itself and the seal before it, so changes show: a row
that is changed, taken out or put in later breaks all seals from there on. The newest seal is also in the process's log, so
that taking off the end shows too.
"""

import contextlib
import hashlib
import hmac
import json
import logging
import os
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from rapp_cloud.database.engine import Database
from rapp_cloud.database.tables import audit
from rapp_cloud.files import write_whole
from rapp_hop.errors import Invalid, Refused

KEY = "audit.key"  # in the data folder
_LOCK = 7_277_002  # any number: the advisory lock of who adds (PostgreSQL)
_MOST = 4000  # characters of a detail
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Entry:
    """One thing that somebody did."""

    number: int  # 1, 2, 3 …
    at: float  # UTC, seconds since 1970
    who: str
    deed: str  # such as install
    subject: str  # such as a RApp
    detail: Mapping[str, Any]


class Audit:
    """The log of one platform. Blocking."""

    def __init__(self, database: Database, folder: Path, clock: Callable[[], float] = time.time) -> None:
        """Prepare.

        :param folder: holds the key; made when it is needed
        """
        self._database = database
        self._path = folder / KEY
        self._clock = clock
        self._waiting: deque[dict[str, Any]] = deque()
        self._writing = threading.Lock()

    def add(self, who: str, deed: str, subject: str = "", **detail: Any) -> None:
        """Note that somebody did something.

        :raises HopError: see `Database.writing`; nothing is noted then
        """
        self.note(who, deed, subject, **detail)
        self.write()

    def note(self, who: str, deed: str, subject: str = "", **detail: Any) -> None:
        """Remember that somebody did something, for the next `write`; blocks nobody."""
        text = json.dumps(detail, sort_keys=True)[:_MOST]
        words = {"who": _plain(who[:100]), "deed": deed[:100], "subject": _plain(subject[:200]), "detail": text}
        row = {"at": round(self._clock(), 3), **words}
        self._waiting.append(row)

    def write(self) -> None:
        """Write what was noted.

        :raises HopError: see `Database.writing`; it is written the next time then
        """
        with self._writing:
            rows = list(self._waiting)
            if rows:
                self._append(rows)
            for _ in rows:
                self._waiting.popleft()

    def _append(self, rows: list[dict[str, Any]]) -> None:
        key = self._key()
        with self._database.writing() as connection:
            if self._database.server:
                connection.execute(sa.text(f"SELECT pg_advisory_xact_lock({_LOCK})"))
            last = connection.execute(sa.select(audit.c.number, audit.c.seal).order_by(audit.c.number.desc()).limit(1)).first()
            number, seal = (last.number, last.seal) if last else (0, "")
            sealed = []
            for row in rows:
                number += 1
                seal = _seal(key, seal, {**row, "number": number})
                sealed.append({**row, "number": number, "seal": seal})
            connection.execute(sa.insert(audit), sealed)
        for row in rows:
            _log.info("%s %s %s", row["who"], row["deed"], row["subject"])
        _log.info("audit log: %d entries, seal %s", number, seal)

    def entries(self, last: int = 100) -> list[Entry]:
        """Return the newest entries, oldest first."""
        wanted = sa.select(audit).order_by(audit.c.number.desc()).limit(last)
        with self._database.reading() as connection:
            rows = connection.execute(wanted).all()
        return [Entry(row.number, row.at, row.who, row.deed, row.subject, _detail(row.detail)) for row in reversed(rows)]

    def check(self, seal: str = "") -> int:
        """Look whether the log is as it was written; return how many entries it has.

        :param seal: one that must be among them, such as the last of a process's log
        :raises Invalid: naming the first entry that is not right
        """
        key, before, count, found = self._key(), "", 0, not seal
        with self._database.reading() as connection:
            for row in connection.execute(sa.select(audit).order_by(audit.c.number)):
                values = dict(row._mapping)
                right = values.pop("seal")
                count += 1
                if values["number"] != count or not hmac.compare_digest(_seal(key, before, values), right):
                    raise Invalid(f"cannot trust the audit log from entry {count} on: it was changed; restore a back-up")
                before, found = right, found or right == seal
        if not found:
            raise Invalid(f"cannot trust the audit log: it ends at entry {count}, before the seal that was given")
        return count

    def _key(self) -> bytes:
        try:
            if not self._path.exists():
                aside = self._path.with_name(f"{KEY}.{secrets.token_hex(6)}")
                write_whole(aside, secrets.token_hex(32).encode(), mode=0o600)
                with contextlib.suppress(FileExistsError):
                    os.link(aside, self._path)  # the first one stays, if two come at once
                aside.unlink()
            return self._path.read_bytes()
        except OSError as error:
            raise Refused(f"cannot use {self._path}: {error.strerror}, check the folder") from None


def _seal(key: bytes, before: str, row: Mapping[str, Any]) -> str:
    fields = [before, row["number"], f"{row['at']:.3f}", row["who"], row["deed"], row["subject"], row["detail"]]
    return hmac.new(key, json.dumps(fields).encode(), hashlib.sha256).hexdigest()


def _plain(text: str) -> str:
    """Return a stranger's words in a form that forges no line of a log."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _detail(text: str) -> Mapping[str, Any]:
    try:
        found = json.loads(text)
    except ValueError:  # it was too long, and cut
        return {"text": text}
    return found if isinstance(found, dict) else {}
