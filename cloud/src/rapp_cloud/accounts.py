"""Who a token is. The database keeps the tokens' hashes; callers are known from memory, so no call waits for the database."""

import hashlib
import logging
import secrets
import time
from collections.abc import Mapping
from pathlib import Path

import sqlalchemy as sa

from rapp_cloud.database.engine import Database
from rapp_cloud.database.tables import marks, tokens
from rapp_cloud.files import read_json
from rapp_hop.errors import Invalid
from rapp_hop.hz.text import check_name

MAX_BYTES = 2**20  # of tokens.json
MIN_TOKEN, MAX_TOKEN = 16, 256  # characters
_MARK = "tokens"
_log = logging.getLogger(__name__)


class Accounts:
    """The tokens of one platform. All but `robot_of` is blocking."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._known: dict[str, str] = {}  # hash to robot; replaced whole, never changed
        self._mark: int | None = None

    def robot_of(self, token: str | None) -> str | None:
        """Return the robot that a token names, or None. By its hash: how long it takes tells nothing of the right one."""
        if token is None or not MIN_TOKEN <= len(token) <= MAX_TOKEN:
            return None
        return self._known.get(_hash(token))

    def refresh(self) -> None:
        """See what other processes have changed since; the first time, everything.

        :raises HopError: see `Database.reading`
        """
        with self._database.reading() as connection:
            mark = connection.execute(sa.select(marks.c.value).where(marks.c.name == _MARK)).scalar()
            if mark == self._mark and mark is not None:
                return
            rows = connection.execute(sa.select(tokens.c.hash, tokens.c.robot)).all()
        self._known, self._mark = {row.hash: row.robot for row in rows}, mark

    def add(self, robot: str) -> str:
        """Make a new token for a robot, keep its hash and return it."""
        token = secrets.token_urlsafe(32)
        self._keep({token: check_name(robot)})
        return token

    def adopt(self, path: Path) -> None:
        """Take over tokens.json of an older platform: keep the hashes, remove the file.

        :raises Invalid: when it is broken
        """
        if not path.exists():
            return
        found = read_json(path, MAX_BYTES)
        if not isinstance(found, dict) or not all(isinstance(robot, str) for robot in found.values()):
            raise Invalid(f"cannot read {path.name}: it must map tokens to names of robots")
        if any(not MIN_TOKEN <= len(token) <= MAX_TOKEN for token in found):
            raise Invalid(f"cannot read {path.name}: a token must have {MIN_TOKEN} to {MAX_TOKEN} characters")
        self._keep({token: check_name(robot) for token, robot in found.items()})
        path.unlink()
        _log.info("tokens: %d taken over from %s, which is gone", len(found), path.name)

    def _keep(self, given: Mapping[str, str]) -> None:
        rows = [{"hash": _hash(token), "robot": robot, "created": time.time()} for token, robot in given.items()]
        with self._database.writing() as connection:
            known = set(connection.execute(sa.select(tokens.c.hash)).scalars())
            new = [row for row in rows if row["hash"] not in known]
            if new:
                connection.execute(sa.insert(tokens), new)
            _raise_mark(connection)
        self.refresh()


def _raise_mark(connection: sa.Connection) -> None:
    if not connection.execute(sa.update(marks).where(marks.c.name == _MARK).values(value=marks.c.value + 1)).rowcount:
        connection.execute(sa.insert(marks).values(name=_MARK, value=1))


def _hash(token: str) -> str:
    return hashlib.sha256(token.encode("utf-8", "replace")).hexdigest()
