"""Back-up and restore: what comes back is what was there, on either database and from one to the other."""

import gzip
import io
import json
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from pathlib import Path

import pytest
import sqlalchemy as sa

from fakes import postgres as pg
from fakes.packages import source_folder
from rapp_cli.__main__ import main as rapp
from rapp_cloud.app import open_shelf
from rapp_cloud.backup import KEPT, back_up, restore
from rapp_cloud.catalogue import RobotKind
from rapp_cloud.database import tables
from rapp_cloud.database.engine import FILE
from rapp_cloud.memory import open_memory
from rapp_cloud.profiles import Contact, Profile
from rapp_cloud.registrations import Registrations
from rapp_cloud.robots import Robots
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.archive import build


@pytest.fixture
def other_url(request: pytest.FixtureRequest, database_url: str) -> Iterator[str | None]:
    """Of the database that `database_url` is not."""
    if database_url.startswith("postgresql"):
        yield None
        return
    with pg.database(request.getfixturevalue("postgres"), "other") as url:
        yield url


def _command(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "rapp_cloud", *words], capture_output=True, text=True, timeout=60, check=False)


def _platform(data: Path, url: str | None, tmp_path: Path) -> str:
    """Make a platform with something of everything; gives a robot's token."""
    data.mkdir()
    shelf = open_shelf(data)
    shelf.create()
    shelf.publish(build(source_folder(tmp_path)))
    (data / "profiles").mkdir()
    (data / "profiles" / "broken.json").write_text("{")
    with open_memory(data, url) as memory:
        token = memory.accounts.add_robot("nao")
        memory.people.add("maria", Profile("Maria", "en", (Contact("Małgorzata", "m@home.example"),)), ["nao"])
        memory.reports.keep("nao", {"run": "r-1", "said": "Dzień dobry \x00"})
        memory.audit.add("nao", "install", "hello")
        robots = Robots(lambda: 0.0, lease=1e6)
        robots.register("nao", RobotKind("nao", "1.0"))
        Registrations(memory.database, robots).write()
    return token


def _content(data: Path, url: str | None) -> dict[str, object]:
    """All but the store and its keys, which are signed anew and changed at a restore."""
    files = {
        str(path.relative_to(data)): (path.read_bytes(), path.stat().st_mode)
        for name in set(KEPT) - {"tuf", "keys"}
        for path in ((data / name).rglob("*") if (data / name).is_dir() else [data / name])
        if path.is_file() and not path.name.startswith(".")
    }
    with open_memory(data, url) as memory, memory.database.reading() as connection:
        rows = {table.name: connection.execute(sa.select(table)).all() for table in tables.metadata.sorted_tables}
    return {**files, **rows}


def test_what_comes_back_is_what_was_there(database_url: str, other_url: str | None, tmp_path: Path) -> None:
    data, again, file = tmp_path / "cloud", tmp_path / "again", tmp_path / "backup"
    token = _platform(data, database_url, tmp_path)
    before = _content(data, database_url)
    assert back_up(data, database_url, file) == file.stat().st_size
    assert file.stat().st_mode & 0o777 == 0o600
    restore(again, other_url, file)
    assert _content(again, other_url) == before
    with open_memory(again, other_url) as memory:
        assert memory.accounts.name_of(token) == "nao"
        assert memory.people.profile("nao").contacts == (Contact("Małgorzata", "m@home.example"),)
        assert [run["said"] for run in memory.reports.of("nao")] == ["Dzień dobry \x00"]
        assert memory.audit.check() == 1
        memory.audit.add("nao", "remove", "hello")
        assert memory.audit.check() == 2
        robots = Robots(lambda: 0.0, lease=1e6)
        Registrations(memory.database, robots).load()
        assert robots.is_here("nao")
    offers = open_shelf(again).offers()
    assert [offer.manifest.name for offer in offers] == ["hello"]
    open_shelf(again).publish(build(source_folder(tmp_path, version="1.1.0")))
    assert sorted(path.name for path in again.iterdir() if path.name.startswith(".")) == []


def test_the_commands(tmp_path: Path) -> None:
    data, again, file = tmp_path / "cloud", tmp_path / "again", tmp_path / "backup"
    _platform(data, None, tmp_path)
    made = _command("backup", "--data", str(data), str(file))
    assert (made.returncode, made.stderr) == (0, "")
    back = _command("restore", "--data", str(again), str(file))
    assert (back.returncode, back.stderr) == (0, "")
    assert "publish it again" in back.stdout and "revoke it again" in back.stdout
    assert _content(again, None) == _content(data, None)
    twice = _command("restore", "--data", str(again), str(file))
    assert twice.returncode == 1
    assert "is there already" in twice.stderr
    nothing = _command("backup", "--data", str(tmp_path / "nothing"), str(tmp_path / "x"))
    assert nothing.returncode == 1
    assert "init" in nothing.stderr


def test_rapp_cloud_backs_up_and_restores(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, again, file = tmp_path / "cloud", tmp_path / "again", tmp_path / "backup"
    _platform(data, None, tmp_path)
    assert rapp(["cloud", "--data", str(data), "backup", str(file)]) == 0
    assert rapp(["cloud", "--data", str(again), "restore", str(file)]) == 0
    assert _content(again, None) == _content(data, None)
    capsys.readouterr()
    assert rapp(["cloud", "--data", str(again), "audit", "--check"]) == 0
    assert capsys.readouterr().out == "1 entries, all as they were written\n"


def test_a_database_that_is_not_empty_is_left_alone(database_url: str, tmp_path: Path) -> None:
    _platform(tmp_path / "cloud", database_url, tmp_path)
    back_up(tmp_path / "cloud", database_url, tmp_path / "backup")
    with pytest.raises(Refused, match="not empty"):
        restore(tmp_path / "again", database_url, tmp_path / "backup")
    assert list((tmp_path / "again").iterdir()) == []
    restore(tmp_path / "again", f"sqlite:///{tmp_path / 'other.sqlite'}", tmp_path / "backup")


@pytest.mark.parametrize("damage", ["cut", "no gzip", "other bytes", "one more", "outside", "symlink", "newer"])
def test_a_damaged_back_up_makes_nothing(tmp_path: Path, damage: str) -> None:
    file, again = tmp_path / "backup", tmp_path / "again"
    _platform(tmp_path / "cloud", None, tmp_path)
    back_up(tmp_path / "cloud", None, file)
    _spoil(file, damage)
    with pytest.raises((Invalid, Refused), match="cannot"):
        restore(again, None, file)
    assert list(again.iterdir()) == []
    assert not (tmp_path / "outside").exists()


def _spoil(file: Path, damage: str) -> None:
    if damage in ("cut", "no gzip"):
        file.write_bytes(file.read_bytes()[:-200] if damage == "cut" else b"<html>")
        return
    members: dict[str, bytes] = {}
    with tarfile.open(file) as archive:
        for member in archive:
            body = archive.extractfile(member)
            assert body is not None
            members[member.name] = body.read()
    if damage == "other bytes":
        members["data/profiles/broken.json"] += b" "
    elif damage == "newer":
        members["rapp-backup.json"] = json.dumps({**json.loads(members["rapp-backup.json"]), "revision": "9999"}).encode()
    elif damage != "symlink":
        members["../../outside" if damage == "outside" else "data/keys/more"] = b"x"
    raw = io.BytesIO()
    with tarfile.open(fileobj=raw, mode="w") as archive:
        for name, content in members.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
        if damage == "symlink":
            link = tarfile.TarInfo("data/tls")
            link.type, link.linkname = tarfile.SYMTYPE, "/etc"
            archive.addfile(link)
    file.write_bytes(gzip.compress(raw.getvalue()))


def test_a_full_disk_leaves_no_half_back_up(tmp_path: Path) -> None:
    _platform(tmp_path / "cloud", None, tmp_path)
    with pytest.raises(Refused, match="cannot write"):
        back_up(tmp_path / "cloud", None, tmp_path / "no" / "such" / "folder")
    assert (tmp_path / "cloud" / FILE).exists()
