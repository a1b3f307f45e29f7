"""One database: transactions, its age, and its errors in our words. Blocking: call it from a thread, never on the event loop."""

import logging
import os
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import alembic.command
import alembic.config
import alembic.util
import sqlalchemy as sa
from sqlalchemy.exc import ArgumentError, DBAPIError, OperationalError, SQLAlchemyError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError

from rapp_cloud.database.secrecy import secrecy_of
from rapp_hop.errors import Bug, Invalid, Refused, Unreachable

FILE = "platform.sqlite"
WAIT = 5.0  # seconds for a lock, or for a server to answer
_AGAIN = 0.02  # seconds between two tries for what SQLite itself does not wait for
_STATEMENT = 20.0  # seconds of one statement (PostgreSQL)
_MIGRATIONS = Path(__file__).parent / "migrations"
_MIGRATING = 7_277_001  # any number: the advisory lock of who migrates (PostgreSQL)
_DAMAGED = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


class Database:
    """Opens connections as they are needed, and keeps some; `close` lets them go."""

    def __init__(self, url: str, wait: float = WAIT) -> None:
        """Prepare; connects to nothing yet.

        :param url: as SQLAlchemy has it, such as sqlite:////data/platform.sqlite or postgresql+psycopg://rapp@host/rapp
        :param wait: seconds for a lock
        :raises Invalid: when the URL is none of these
        :raises Refused: see `secrecy_of`
        """
        try:
            parsed = sa.make_url(url)
        except ArgumentError:
            raise Invalid("cannot read the database's URL: write postgresql+psycopg://USER@HOST/NAME") from None
        if parsed.drivername == "postgresql":
            parsed = parsed.set(drivername="postgresql+psycopg")
        if parsed.drivername == "sqlite":
            self._file: Path | None = Path(parsed.database or "")
            self._engine = sa.create_engine(parsed, connect_args={"timeout": wait}, hide_parameters=True)
            sa.event.listen(self._engine, "connect", lambda connection, _record: _prepare_sqlite(connection, wait))
            sa.event.listen(self._engine, "begin", _begin_sqlite)
        elif parsed.drivername == "postgresql+psycopg":
            self._file = None
            options = f"-c statement_timeout={int(_STATEMENT * 1000)} -c lock_timeout={int(wait * 1000)}"
            self._engine = sa.create_engine(
                parsed, pool_pre_ping=True, pool_timeout=wait, hide_parameters=True,
                connect_args={
                    "connect_timeout": max(2, int(wait)), "options": options, "application_name": "rapp-cloud", **secrecy_of(parsed)
                },
            )  # fmt: skip
        else:
            raise Invalid(f"cannot use a database of type {parsed.drivername}: there are sqlite and postgresql")

    @property
    def server(self) -> bool:
        """Whether it is PostgreSQL."""
        return self._file is None

    @contextmanager
    def reading(self) -> Iterator[sa.Connection]:
        """A transaction that sees one state of everything.

        :raises Unreachable: when the database is away or locked
        :raises Invalid: when it is damaged
        :raises Bug: for all else that it says no to
        """
        level: dict[str, Any] = {"isolation_level": "REPEATABLE READ"} if self.server else {}
        with _translated(), self._engine.connect().execution_options(**level) as connection, connection.begin():
            yield connection

    @contextmanager
    def writing(self) -> Iterator[sa.Connection]:
        """A transaction that changes something, or nothing when the block raises. Raises as `reading`."""
        with _translated(), self._engine.connect().execution_options(writes=True) as connection, connection.begin():
            yield connection

    def migrate(self, revision: str = "head") -> None:
        """Make the tables, or bring those of an older version up to date; all of it or nothing.

        :param revision: to stop at
        :raises Refused: when a newer version of the platform has been here
        :raises HopError: as `reading`
        """
        self._make_file()
        logging.getLogger("alembic").setLevel(logging.WARNING)
        with self.writing() as connection:
            if self.server:
                connection.execute(sa.text(f"SELECT pg_advisory_xact_lock({_MIGRATING})"))
            elif (found := connection.exec_driver_sql("PRAGMA quick_check(1)").scalar()) != "ok":
                raise Invalid(f"cannot use the database {self._file}: it is damaged ({found}); restore a back-up")
            config = alembic.config.Config()
            config.set_main_option("script_location", str(_MIGRATIONS).replace("%", "%%"))
            config.attributes["connection"] = connection
            try:
                alembic.command.upgrade(config, revision)
            except alembic.util.CommandError:
                raise Refused("cannot use the database: a newer version of the platform has changed it, start that one") from None

    def check(self) -> None:
        """See that it can be written to; changes nothing.

        :raises HopError: see `reading`
        """
        with self.writing() as connection:
            connection.exec_driver_sql("SELECT 1")

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()

    def _make_file(self) -> None:
        if self._file is not None:
            try:
                # SQLite gives its other files the mode of this one. To open one that is there would undo our locks on it.
                os.close(os.open(self._file, os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600))
            except FileExistsError:
                return
            except OSError as error:
                raise Refused(f"cannot use the database {self._file}: {error.strerror}, run rapp_cloud init first") from None


def _prepare_sqlite(connection: Any, wait: float) -> None:
    connection.isolation_level = None  # we begin transactions ourselves
    until = time.monotonic() + wait
    while not _has_log(connection):
        if time.monotonic() > until:
            break  # whoever uses the connection is told that it is locked
        time.sleep(_AGAIN)
    for pragma in ("synchronous=FULL", "foreign_keys=ON"):
        connection.execute(f"PRAGMA {pragma}")


def _has_log(connection: Any) -> bool:
    """Have changes written ahead; False while another connection does the same, for which SQLite does not wait."""
    try:
        connection.execute("PRAGMA journal_mode=WAL")
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY:
            raise
        return False
    return True


def _begin_sqlite(connection: sa.Connection) -> None:
    # Who reads first and writes later may find the file locked with no way to wait; who will write says so at once.
    writes = connection.get_execution_options().get("writes")
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


@contextmanager
def _translated() -> Iterator[None]:
    try:
        yield
    except DBAPIError as error:
        # The text of SQLAlchemy's own errors has statements in it.
        what = str(error.orig).strip().partition("\n")[0] or type(error.orig).__name__
        if getattr(error.orig, "sqlite_errorcode", 0) & 0xFF in _DAMAGED:
            raise Invalid(f"cannot use the database: {what}; restore a back-up") from error
        if isinstance(error, OperationalError) or error.connection_invalidated:
            raise Unreachable(f"cannot use the database now: {what}; try again later") from error
        raise Bug(f"cannot do this in the database: {what}; that is a fault of the platform, tell its makers") from error
    except PoolTimeoutError as error:
        raise Unreachable("cannot use the database now: too many wait for it; try again later") from error
    except SQLAlchemyError as error:
        what = type(error).__name__
        raise Bug(f"cannot use the database: {what}; that is a fault of the platform, tell its makers") from error
