"""The robots' leases beyond the end of the process: written behind, read at start, so that a new one knows who is here."""

import time
from collections.abc import Callable

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from rapp_cloud.catalogue import RobotKind
from rapp_cloud.database.engine import Database
from rapp_cloud.database.tables import robots
from rapp_cloud.robots import Lease, Robots


class Registrations:
    """Keeps `Robots` in a database. Blocking; from one thread at a time."""

    def __init__(self, database: Database, here: Robots, clock: Callable[[], float] = time.time) -> None:
        """Begin.

        :param clock: wall time, for the process that comes after us
        """
        self._database = database
        self._here = here
        self._clock = clock
        self._written: dict[str, Lease] = {}

    def load(self) -> None:
        """Let those be here whose lease still holds; a clock that was moved makes none longer than it may be."""
        now = self._clock()
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(robots).where(robots.c.until > now)).all()
        for row in rows:
            self._here.resume(row.name, RobotKind(row.kind, row.api_version), row.until - now)

    def write(self) -> None:
        """Write what has changed since the last time.

        :raises HopError: see `Database.writing`; it is written the next time then
        """
        leases = self._here.leases()
        changed = {name: lease for name, lease in leases.items() if self._written.get(name) != lease}
        if not changed:
            return
        ahead = self._clock() - self._here.now()
        rows = [
            {"name": name, "kind": lease.kind.kind, "api_version": lease.kind.api_version, "until": lease.until + ahead}
            for name, lease in sorted(changed.items())  # in one order, so that two writers do not wait for each other
        ]
        with self._database.writing() as connection:
            connection.execute(self._putting(), rows)
        self._written = leases

    def _putting(self) -> sa.Insert:
        """Another process may write the same robot at the same time; the later one stays."""
        new = (postgresql if self._database.server else sqlite).insert(robots)
        changes = {name: new.excluded[name] for name in ("kind", "api_version", "until")}
        found: sa.Insert = new.on_conflict_do_update(index_elements=["name"], set_=changes)
        return found
