"""How often each token with a quota has called today (UTC): counted in memory, written behind, read at start.

What a killed process has counted since its last write (half a second) is lost. Processes that share a database add to the same
numbers, and each sees those of the others when it starts.
"""

import time
from collections.abc import Callable

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from rapp_cloud.database.engine import Database
from rapp_cloud.database.tables import calls
from rapp_hop.errors import Unreachable
from rapp_hop.protocol import TURNED_AWAY

DAY = 86400  # seconds


class Quotas:
    """The counts of one platform. `load` and `write` are blocking, and called from one thread at a time."""

    def __init__(self, database: Database, clock: Callable[[], float] = time.time) -> None:
        """Begin with nobody.

        :param clock: wall time
        """
        self._database = database
        self._clock = clock
        self._today: tuple[int, dict[str, int]] = (0, {})  # the day since 1970, calls by the token's id
        self._written: tuple[int, dict[str, int]] = (0, {})

    def count(self, token: str, quota: int) -> None:
        """Count one call, unless it is one too many.

        :param token: its id
        :param quota: calls per day
        :raises Unreachable: (429) when it is; `retry_after` says when the next day begins
        """
        now = self._clock()
        if int(now // DAY) != self._today[0]:
            self._today = int(now // DAY), {}
        counts = self._today[1]
        if counts.get(token, 0) >= quota:
            error = Unreachable(f"cannot serve more than {quota} calls a day with this token: come again tomorrow (UTC)", 429)
            error.reason, error.retry_after = TURNED_AWAY, int(DAY - now % DAY) + 1
            raise error
        counts[token] = counts.get(token, 0) + 1

    def load(self) -> None:
        """Go on from what was written today.

        :raises HopError: see `Database.reading`
        """
        day = int(self._clock() // DAY)
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(calls).where(calls.c.day == day)).all()
        self._today = day, {row.token: row.calls for row in rows}
        self._written = day, dict(self._today[1])

    def write(self) -> None:
        """Add to the database what was counted since the last time; what is of days before goes.

        :raises HopError: see `Database.writing`; it is written the next time then
        """
        day, counts = self._today
        counts = dict(counts)
        before = self._written[1] if self._written[0] == day else {}
        rows = [
            {"token": token, "day": day, "calls": count - before.get(token, 0)}
            for token, count in counts.items()
            if count != before.get(token, 0)
        ]
        if not rows:
            return
        with self._database.writing() as connection:
            connection.execute(self._adding(), rows)
            connection.execute(sa.delete(calls).where(calls.c.day < day))
        self._written = day, counts

    def _adding(self) -> sa.Insert:
        if self._database.server:
            new = postgresql.insert(calls)
            return new.on_conflict_do_update(index_elements=["token", "day"], set_={"calls": calls.c.calls + new.excluded.calls})
        row = sqlite.insert(calls)
        return row.on_conflict_do_update(index_elements=["token", "day"], set_={"calls": calls.c.calls + row.excluded.calls})
