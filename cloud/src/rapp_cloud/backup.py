"""Back-up and restore of a whole platform: every table, the store with its keys, settings, in one file.

The tables are written as JSON lines, so a back-up of SQLite can be restored into PostgreSQL and the other way round. The file
holds the platform's secrets: its mode is 0600. The passphrase of the store's keys is not in it, else it would be worth nothing
there; one that lies beside the keys goes into a file of its own, to be kept apart. Taken while the platform serves, a back-up is
one state of the database and one of the store. Blocking.
"""

import hashlib
import io
import json
import os
import secrets
import shutil
import tarfile
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any

import sqlalchemy as sa

from rapp_cloud.custody import Custody
from rapp_cloud.database.engine import FILE, Database
from rapp_cloud.files import copy_whole
from rapp_cloud.keys import BESIDE, KeyRing, Passphrase
from rapp_cloud.ledger import Ledger
from rapp_cloud.memory import url_of
from rapp_hop.errors import HopError, Invalid, Refused
from rapp_hop.hz.lock import held

FORMAT = 1
KEPT = ("audit.key", "cloud.toml", "keys", "profiles", "robots", "root.json", "tls", "tuf")
"""What of the data folder is in a back-up, beside the database; the rest is of the moment. (Profiles that could not be taken over
are files still.)"""
_LIST = "rapp-backup.json"
_ASIDE = ".restoring"
_ROWS = 1000  # inserted at once


@dataclass(frozen=True)
class Restored:
    """What a restore has made."""

    at: float  # when the back-up was made; UTC, seconds since 1970
    left: str  # why robots that saw a newer store do not believe this one yet; empty: they do
    expired: list[str]  # see `Custody.resume`


def passphrase_of(file: Path) -> Path:
    """Return where the passphrase of a back-up's keys is, if the platform kept it beside them."""
    return file.with_name(f"{file.name}.{BESIDE}")


def back_up(data: Path, url: str | None, file: Path, passphrase: Passphrase | None = None) -> int:
    """Write a back-up, and `passphrase_of` it when there is one to be written; return the back-up's length in bytes.

    :param passphrase: of the store's keys; its file stays out of the back-up wherever it is
    :raises Refused: when there is no platform, or the file cannot be written
    :raises HopError: see `Database.reading`
    """
    if not (data / "tuf").is_dir():
        raise Refused(f"cannot back up {data}: no platform is there, run rapp_cloud init first")
    database = Database(url_of(data, url))
    aside = file.with_name(f".{file.name}.{secrets.token_hex(6)}")
    try:
        database.migrate()
        with _private(aside) as raw, held(data / "tuf" / ".lock", "back up"):
            _write(raw, data, database, passphrase.file if passphrase else None)
        if (data / "keys" / BESIDE).exists():
            copy_whole(data / "keys" / BESIDE, passphrase_of(file), mode=0o600)
        aside.replace(file)
    except OSError as error:
        raise Refused(f"cannot write {file}: {error.strerror}, choose another place") from None
    finally:
        aside.unlink(missing_ok=True)
        database.close()
    return file.stat().st_size


def restore(data: Path, url: str | None, file: Path, passphrase: Passphrase | None = None) -> Restored:
    """Make a platform of a back-up, where none is, and have robots believe it again (`Custody.resume`).

    :param passphrase: of the store's keys; when nobody names one, that of `passphrase_of` is put beside them
    :raises Refused: when there is a platform already, or the file cannot be read
    :raises Invalid: when the back-up is damaged; nothing has been made then
    """
    here = [name for name in (*KEPT, FILE) if (data / name).exists()]
    if here:
        raise Refused(f"cannot restore into {data}: {here[0]} is there already, name an empty folder")
    data.mkdir(parents=True, exist_ok=True, mode=0o700)
    aside = data / _ASIDE
    shutil.rmtree(aside, ignore_errors=True)
    database = Database(url_of(data, url))
    try:
        listed = _unpack(file, aside)
        database.migrate(listed["revision"])
        for path in sorted((aside / "data").iterdir()):
            path.rename(data / path.name)
        _fill(database, aside / "tables", listed["tables"])  # last, so that a database with rows is a whole one
        database.migrate()
    except BaseException:
        for name in KEPT:
            if (data / name).exists():
                (data / name).rename(aside / name)
        if not database.server:
            for path in data.glob(f"{FILE}*"):
                path.unlink()
        raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)
        database.close()
    return _resumed(data, passphrase or Passphrase(), passphrase_of(file), float(listed["at"]))


def _resumed(data: Path, passphrase: Passphrase, given: Path, at: float) -> Restored:
    try:
        if passphrase == Passphrase() and given.exists() and not (data / "keys" / BESIDE).exists():
            copy_whole(given, data / "keys" / BESIDE, mode=0o600)
        return Restored(at, "", Custody(Ledger(data / "tuf" / "metadata", KeyRing(data / "keys", passphrase))).resume())
    except (HopError, OSError) as error:
        return Restored(at, str(error), [])


@contextmanager
def _private(path: Path) -> Iterator[IO[bytes]]:
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600), "wb") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())


def _write(raw: IO[bytes], data: Path, database: Database, secret: Path | None) -> None:
    listed: dict[str, Any] = {"format": FORMAT, "at": time.time(), "tables": {}, "files": {}}
    with tarfile.open(fileobj=raw, mode="w:gz", compresslevel=6) as archive, database.reading() as connection:
        listed["revision"] = connection.execute(sa.text("SELECT version_num FROM alembic_version")).scalar_one()
        for table in _tables(connection):
            rows = [dict(row._mapping) for row in connection.execute(sa.select(table))]
            listed["tables"][table.name] = len(rows)
            _add(archive, listed, f"tables/{table.name}.jsonl", "".join(json.dumps(row) + "\n" for row in rows).encode())
        for path in _files(data, {data / "keys" / BESIDE, secret and secret.resolve()}):
            _add(archive, listed, f"data/{path.relative_to(data)}", path.read_bytes(), path.stat().st_mode & 0o777)
        text = json.dumps(listed).encode()
        _add(archive, listed, _LIST, text)


def _add(archive: tarfile.TarFile, listed: dict[str, Any], name: str, content: bytes, mode: int = 0o600) -> None:
    member = tarfile.TarInfo(name)
    member.size, member.mode, member.mtime = len(content), mode, int(time.time())
    archive.addfile(member, io.BytesIO(content))
    listed["files"][name] = hashlib.sha256(content).hexdigest()


def _files(data: Path, without: Collection[Path | None]) -> Iterator[Path]:
    for name in KEPT:
        path = data / name
        found = sorted(path.rglob("*")) if path.is_dir() else [path]
        kept = (one for one in found if one.is_file() and not one.is_symlink() and not one.name.startswith("."))
        yield from (one for one in kept if not {one, one.resolve()} & {*without})


def _unpack(file: Path, aside: Path) -> dict[str, Any]:
    """Unpack into a new folder; every file must be one that the list names, with its hash."""
    found: dict[str, str] = {}
    try:
        with tarfile.open(file, "r:gz") as archive:
            for member in archive:
                path = PurePosixPath(member.name)
                body = archive.extractfile(member) if member.isreg() else None
                if body is None or path.is_absolute() or ".." in path.parts:
                    raise Invalid(f"cannot restore {file}: {member.name[:80]!r} does not belong there")
                (aside / path).parent.mkdir(parents=True, exist_ok=True, mode=0o700)
                content = body.read()
                with _private(aside / path) as raw:
                    raw.write(content)
                (aside / path).chmod(member.mode & 0o755)
                found[member.name] = hashlib.sha256(content).hexdigest()
        listed: dict[str, Any] = json.loads((aside / _LIST).read_bytes())
    except (tarfile.TarError, EOFError, ValueError) as error:
        raise Invalid(f"cannot restore {file}: it is no back-up, or a damaged one ({error})") from None
    except OSError as error:
        raise Refused(f"cannot restore {file}: {error.strerror or error}, check the file and the disk") from None
    del found[_LIST]
    if listed.get("format") != FORMAT or listed.get("files") != found:
        raise Invalid(f"cannot restore {file}: what is in it is not what its list says")
    return listed


def _fill(database: Database, folder: Path, expected: dict[str, int]) -> None:
    with database.writing() as connection:
        tables = _tables(connection)
        if {table.name for table in tables} != set(expected):
            raise Invalid("cannot restore: the back-up's tables are not those of its version")
        if any(connection.execute(sa.select(sa.func.count()).select_from(table)).scalar() for table in tables):
            raise Refused("cannot restore into this database: it is not empty, name another")
        for table in tables:
            rows = [json.loads(line) for line in (folder / f"{table.name}.jsonl").read_text("utf-8").splitlines()]
            for begin in range(0, len(rows), _ROWS):
                connection.execute(sa.insert(table), rows[begin : begin + _ROWS])


def _tables(connection: sa.Connection) -> list[sa.Table]:
    """All tables as they are in the database, those that others refer to first."""
    found = sa.MetaData()
    found.reflect(connection)
    return [table for table in found.sorted_tables if table.name != "alembic_version"]
