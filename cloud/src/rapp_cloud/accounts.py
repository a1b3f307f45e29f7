"""Users, publishers and robots, and their tokens. The database keeps hashes; callers are known from memory, so no call waits."""

import hashlib
import logging
import secrets
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from rapp_cloud.database.engine import Database
from rapp_cloud.database.marks import mark_of, raise_mark
from rapp_cloud.database.tables import accounts, tokens
from rapp_cloud.files import read_json
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.text import check_name

MAX_BYTES = 2**20  # of tokens.json
MIN_TOKEN, MAX_TOKEN = 16, 256  # characters
ID = 12  # hexadecimal digits of a token's hash by which people name it
SCOPES: Mapping[str, frozenset[str]] = {
    "robot": frozenset({"robot"}),
    "user": frozenset({"read"}),
    "publisher": frozenset({"read", "publish"}),
}
"""What each role may be allowed: be a robot; see runs; put packages on offer."""
_MARK = "tokens"
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Holder:
    """What a token says."""

    token: str  # its id
    name: str
    scopes: frozenset[str]
    expires: float | None = None  # UTC, seconds since 1970
    rate: float | None = None  # calls per second; None: the platform's
    quota: int | None = None  # calls per day (UTC); None: no limit


class Accounts:
    """The accounts and tokens of one platform. All but `holder` and `name_of` is blocking."""

    def __init__(self, database: Database, clock: Callable[[], float] = time.time) -> None:
        self.database = database
        self.clock = clock
        self._known: dict[str, Holder] = {}  # by the token's hash; replaced whole, never changed
        self._mark: int | None = None

    def holder(self, token: str | None) -> Holder | None:
        """Return what a token says, or None. Found by its hash: how long it takes tells nothing of the right one."""
        if token is None or not MIN_TOKEN <= len(token) <= MAX_TOKEN:
            return None
        found = self._known.get(hash_of(token))
        if found is None or (found.expires is not None and found.expires <= self.clock()):
            return None
        return found

    def name_of(self, token: str | None) -> str | None:
        """Return whom a token names, or None."""
        found = self.holder(token)
        return found.name if found else None

    def may(self, name: str, scope: str) -> bool:
        """Tell whether some token of this name allows that."""
        return any(holder.name == name and scope in holder.scopes for holder in self._known.values())

    def refresh(self) -> None:
        """See what other processes have changed since; the first time, everything.

        :raises HopError: see `Database.reading`
        """
        with self.database.reading() as connection:
            mark = mark_of(connection, _MARK)
            if mark == self._mark and mark is not None:
                return
            rows = connection.execute(sa.select(tokens).where(tokens.c.revoked.is_(None))).all()
        self._known = {row.hash: _holder(row) for row in rows}
        self._mark = mark

    def add_robot(self, robot: str) -> str:
        """Make a robot's account, if it has none yet, and a token for it; return the token."""
        with self.database.writing() as connection:
            self.add_account(connection, robot, "robot")
            token = self.add_token(connection, robot)
        self.refresh()
        return token

    def give(self, name: str, scopes: Collection[str] = (), life: float | None = None, **limits: Any) -> str:
        """Make a token for an account and return it.

        :param scopes: none: all of its role
        :param life: seconds; None: until it is revoked
        :param limits: `rate` and `quota`, see `Holder`
        :raises Refused: when there is no such account, or its role allows less
        """
        with self.database.writing() as connection:
            token = self.add_token(connection, name, scopes, life, **limits)
        self.refresh()
        return token

    def add_token(
        self, connection: sa.Connection, name: str, scopes: Collection[str] = (), life: float | None = None, **limits: Any
    ) -> str:
        """Do as `give`, within a transaction."""
        role = connection.execute(sa.select(accounts.c.role).where(accounts.c.name == name)).scalar()
        if role is None:
            raise Refused(f"cannot give {name[:70]!r} a token: there is no such account")
        if more := sorted(set(scopes) - SCOPES[role]):
            raise Refused(f"cannot give {name} the scope {more[0]}: a {role} may have {', '.join(sorted(SCOPES[role]))}")
        token, now = secrets.token_urlsafe(32), self.clock()
        words = " ".join(sorted(scopes or SCOPES[role]))
        row = {"hash": hash_of(token), "name": name, "created": now, "scopes": words, "expires": now + life if life else None}
        connection.execute(sa.insert(tokens).values(**row, **limits))
        raise_mark(connection, _MARK)
        return token

    def revoke(self, begin: str) -> int:
        """Take back the token of this id, or all tokens of this account; return how many."""
        wanted = (tokens.c.name == begin) | (tokens.c.hash.startswith(begin) if len(begin) >= ID else sa.false())
        with self.database.writing() as connection:
            change = sa.update(tokens).where(wanted, tokens.c.revoked.is_(None)).values(revoked=self.clock())
            count = connection.execute(change).rowcount
            raise_mark(connection, _MARK)
        self.refresh()
        return count

    def list(self) -> list[Holder]:
        """Return the tokens that were not revoked, by name."""
        wanted = sa.select(tokens).where(tokens.c.revoked.is_(None)).order_by(tokens.c.name, tokens.c.created)
        with self.database.reading() as connection:
            return [_holder(row) for row in connection.execute(wanted)]

    def open(self, name: str, role: str, password: str | None = None) -> None:
        """Make an account.

        :param password: as its hash
        :raises Refused: when somebody of another role has the name
        """
        with self.database.writing() as connection:
            self.add_account(connection, name, role, password)

    def close(self, connection: sa.Connection, name: str) -> None:
        """Take back an account and all its tokens, within a transaction."""
        mine = sa.update(tokens).where(tokens.c.name == name, tokens.c.revoked.is_(None))
        connection.execute(mine.values(revoked=self.clock()))
        connection.execute(sa.delete(accounts).where(accounts.c.name == name))
        raise_mark(connection, _MARK)

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
        given = {token: check_name(robot) for token, robot in found.items()}
        with self.database.writing() as connection:
            known = set(connection.execute(sa.select(tokens.c.hash)).scalars())
            for token, robot in given.items():
                self.add_account(connection, robot, "robot")
                row = {"hash": hash_of(token), "name": robot, "created": self.clock(), "scopes": "robot"}
                if row["hash"] not in known:
                    connection.execute(sa.insert(tokens).values(row))
            raise_mark(connection, _MARK)
        path.unlink()
        _log.info("tokens: %d taken over from %s, which is gone", len(found), path.name)

    def add_account(self, connection: sa.Connection, name: str, role: str, password: str | None = None) -> None:
        """Do as `open`, within a transaction."""
        here = accounts.c.name == check_name(name)
        known = connection.execute(sa.select(accounts.c.role).where(here)).scalar()
        if known not in (None, role):
            raise Refused(f"cannot make {name} a {role}: it is a {known} already, choose another name")
        if known is None:
            row = {"name": name, "role": role, "password": password, "created": self.clock()}
            connection.execute(sa.insert(accounts).values(row))
        elif password is not None:
            connection.execute(sa.update(accounts).where(here).values(password=password))


def hash_of(secret: str) -> str:
    """Return the hash by which a token or code is kept; they are too long to be guessed, so it need not be slow."""
    return hashlib.sha256(secret.encode("utf-8", "replace")).hexdigest()


def _holder(row: Any) -> Holder:
    return Holder(row.hash[:ID], row.name, frozenset(row.scopes.split()), row.expires, row.rate, row.quota)
