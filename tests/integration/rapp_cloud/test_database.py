"""What the platform keeps, on SQLite and on a real PostgreSQL: the same tests on both."""

import json
import threading
from pathlib import Path

import alembic.autogenerate
import alembic.migration
import pytest
import sqlalchemy as sa

from rapp_cloud import reports as reports_module
from rapp_cloud.accounts import Accounts
from rapp_cloud.audit import Audit
from rapp_cloud.catalogue import RobotKind
from rapp_cloud.database import tables
from rapp_cloud.database.engine import Database
from rapp_cloud.registrations import Registrations
from rapp_cloud.reports import Reports
from rapp_cloud.robots import Robots
from rapp_hop.errors import Bug, Invalid, Refused, Unreachable

NAO = RobotKind("nao", "1.0")


def test_the_migrations_make_the_tables(database: Database) -> None:
    with database.reading() as connection:
        context = alembic.migration.MigrationContext.configure(connection, opts={"compare_type": True})
        assert alembic.autogenerate.compare_metadata(context, tables.metadata) == []
    database.migrate()  # again is fine


def test_a_newer_platform_s_database_is_left_alone(database: Database) -> None:
    with database.writing() as connection:
        connection.execute(sa.text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(Refused, match="a newer version"):
        database.migrate()


def test_two_processes_migrate_at_once(database_url: str) -> None:
    failed: list[BaseException] = []
    start = threading.Barrier(3)

    def migrate() -> None:
        database = Database(database_url, wait=30)
        start.wait()
        try:
            database.migrate()
        except BaseException as error:  # noqa: BLE001 (told in the test)
            failed.append(error)
        finally:
            database.close()

    threads = [threading.Thread(target=migrate) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert failed == []


def test_what_fails_half_way_changes_nothing(database: Database) -> None:
    with pytest.raises(ZeroDivisionError), database.writing() as connection:
        connection.execute(sa.insert(tables.marks).values(name="x", value=1))
        raise ZeroDivisionError
    with database.reading() as connection:
        assert connection.execute(sa.select(tables.marks)).all() == []


def test_tokens_name_robots_and_are_not_kept(database: Database) -> None:
    accounts = Accounts(database)
    accounts.refresh()
    assert accounts.name_of("x" * 32) is None
    one, two = accounts.add_robot("nao"), accounts.add_robot("other")
    assert (accounts.name_of(one), accounts.name_of(two)) == ("nao", "other")
    with database.reading() as connection:
        assert one not in str(connection.execute(sa.select(tables.tokens)).all())


def test_h14_wrong_tokens(database: Database) -> None:
    accounts = Accounts(database)
    token = accounts.add_robot("nao")
    for wrong in (None, "", token[:-1], token + "x", token.swapcase(), "é" * 20, "\udcff" * 20, "x" * 10_000, f" {token}"):
        assert accounts.name_of(wrong) is None


def test_another_process_s_token_is_seen(database: Database) -> None:
    here, there = Accounts(database), Accounts(database)
    here.refresh()
    token = there.add_robot("nao")
    assert here.name_of(token) is None
    here.refresh()
    assert here.name_of(token) == "nao"


def test_the_token_file_of_an_older_platform_is_taken_over(database: Database, tmp_path: Path) -> None:
    path = tmp_path / "tokens.json"
    path.write_text(json.dumps({"x" * 32: "nao"}))
    accounts = Accounts(database)
    accounts.adopt(path)
    accounts.refresh()
    assert accounts.name_of("x" * 32) == "nao"
    assert not path.exists()
    accounts.adopt(path)


@pytest.mark.parametrize("text", ["[]", '{"short": "nao"}', '{"xxxxxxxxxxxxxxxxxxxx": 3}', '{"xxxxxxxxxxxxxxxxxxxx": "../x"}', "{"])
def test_a_broken_token_file_is_named_and_stays(text: str, tmp_path: Path) -> None:
    path = tmp_path / "tokens.json"
    path.write_text(text)
    with pytest.raises(Invalid):
        Accounts(Database(f"sqlite:///{tmp_path / 'x'}")).adopt(path)
    assert path.read_text() == text


def test_reports_are_kept_once_per_run(database: Database) -> None:
    kept = Reports(database)
    assert kept.keep("nao", {"run": "r-1", "outcome": "failed"}) == ("r-1", True)
    assert kept.keep("nao", {"run": "r-1", "outcome": "done", "said": "\x00 „ä“"}) == ("r-1", False)
    kept.keep("nao", {"run": "../../etc/passwd"})
    kept.keep("other", {"run": "r-1"})
    assert [run["run"] for run in kept.of("nao")] == ["../../etc/passwd", "r-1"]
    assert kept.of("nao")[1]["said"] == "\x00 „ä“"
    assert [(run["robot"], run["run"]) for run in kept.of(None, 1)] == [("other", "r-1")]


def test_reports_are_bounded(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reports_module, "KEPT", 3)
    kept = Reports(database)
    for number in range(6):
        kept.keep("nao", {"run": f"r{number}"})
    assert [run["run"] for run in kept.of("nao")] == ["r5", "r4", "r3"]


def test_the_report_files_of_an_older_platform_are_taken_over(database: Database, tmp_path: Path) -> None:
    folder = tmp_path / "reports" / "nao"
    folder.mkdir(parents=True)
    (folder / "r-1.json").write_text('{"run": "r-1"}')
    (folder / "r-2.json").write_text("{")
    kept = Reports(database)
    kept.adopt(tmp_path / "reports")
    assert [run["run"] for run in kept.of("nao")] == ["r-1"]
    assert not (tmp_path / "reports").exists()
    kept.adopt(tmp_path / "reports")


def test_leases_outlive_the_process(database: Database) -> None:
    clock, wall = [100.0], [5000.0]
    robots = Robots(lambda: clock[0], lease=10)
    registrations = Registrations(database, robots, lambda: wall[0])
    robots.register("nao", NAO)
    robots.register("old", NAO)
    registrations.write()
    clock[0], wall[0] = 106.0, 5006.0
    assert robots.heartbeat("nao")
    registrations.write()
    later = Robots(lambda: 7.0, lease=10)
    Registrations(database, later, lambda: 5012.0).load()
    assert later.kind_of("nao") == NAO
    assert not later.is_here("old")


def test_two_platforms_register_the_same_robots_at_once(database: Database, database_url: str) -> None:
    failed: list[BaseException] = []
    together = threading.Barrier(2)

    def register(until: float) -> None:
        own, robots = Database(database_url, wait=30), Robots(lambda: until, lease=10)
        registrations = Registrations(own, robots, lambda: until)
        try:
            for number in range(40):
                robots.register(f"nao{number}", NAO)
                together.wait(60)
                registrations.write()
        except BaseException as error:  # noqa: BLE001 (told in the test)
            failed.append(error)
            together.abort()
        own.close()

    threads = [threading.Thread(target=register, args=(until,)) for until in (100.0, 200.0)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert failed == []
    with database.reading() as connection:
        assert len(connection.execute(sa.select(tables.robots)).all()) == 40


def test_what_the_database_says_no_to_is_an_error_of_ours(database: Database) -> None:
    row = sa.insert(tables.marks).values(name="x", value=1)
    with pytest.raises(Bug, match="cannot do this in the database"), database.writing() as connection:
        connection.execute(row)
        connection.execute(row)
    with pytest.raises(Bug, match="NoResultFound"), database.reading() as connection:
        connection.execute(sa.select(tables.marks)).one()


def test_o07_a_clock_put_back_makes_no_lease_longer(database: Database) -> None:
    robots = Robots(lambda: 100.0, lease=10)
    robots.register("nao", NAO)
    Registrations(database, robots, lambda: 1e9).write()
    clock = [0.0]
    later = Robots(lambda: clock[0], lease=10)
    Registrations(database, later, lambda: 5.0).load()
    assert later.is_here("nao")
    clock[0] = 10.0
    assert not later.is_here("nao")


def test_o10_the_audit_log_is_only_added_to(database: Database, tmp_path: Path) -> None:
    log = Audit(database, tmp_path)
    for number in range(3):
        log.add("nao", "install", f"rapp{number}", version="1.0.0")
    assert [entry.subject for entry in log.entries(2)] == ["rapp1", "rapp2"]
    assert log.entries()[0].detail == {"version": "1.0.0"}
    assert log.check() == 3
    for statement in (sa.update(tables.audit).values(who="x"), sa.delete(tables.audit)):
        with pytest.raises(Bug, match="only added to"), database.writing() as connection:
            connection.execute(statement)
    assert log.check() == 3


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE audit SET who = 'x' WHERE number = 2",
        "DELETE FROM audit WHERE number = 2",
        "UPDATE audit SET number = 4 WHERE number = 3",
        "DELETE FROM audit WHERE number = 3",
    ],
)
def test_o10_a_changed_audit_log_shows(database: Database, tmp_path: Path, change: str) -> None:
    log = Audit(database, tmp_path)
    for number in range(3):
        log.add("nao", "run", f"rapp{number}")
    with database.reading() as connection:
        seal = connection.execute(sa.select(tables.audit.c.seal).where(tables.audit.c.number == 3)).scalar_one()
    assert log.check(seal) == 3
    with database.writing() as connection:  # who owns the database can take the triggers away
        if database.server:
            connection.execute(sa.text("ALTER TABLE audit DISABLE TRIGGER ALL"))
        else:
            for name in ("audit_no_update", "audit_no_delete"):
                connection.execute(sa.text(f"DROP TRIGGER {name}"))
        connection.execute(sa.text(change))
    with pytest.raises(Invalid, match="cannot trust the audit log"):
        log.check(seal)


def test_o10_two_processes_add_to_one_chain(database: Database, database_url: str, tmp_path: Path) -> None:
    def add(who: str) -> None:
        own = Database(database_url, wait=30)
        for number in range(10):
            Audit(own, tmp_path).add(who, "run", str(number))
        own.close()

    threads = [threading.Thread(target=add, args=(f"robot{number}",)) for number in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert Audit(database, tmp_path).check() == 30


def test_o01_a_locked_database_is_unreachable_and_then_not(database: Database, database_url: str) -> None:
    other = Database(database_url, wait=0.2)
    kept = Reports(other)
    with database.writing() as connection:
        if database.server:
            connection.execute(sa.text("LOCK TABLE runs IN ACCESS EXCLUSIVE MODE"))
        with pytest.raises(Unreachable, match="try again later"):
            kept.keep("nao", {"run": "r-1"})
    kept.keep("nao", {"run": "r-1"})
    assert [run["run"] for run in kept.of("nao")] == ["r-1"]
    other.close()


@pytest.mark.parametrize("where", [0, 4096])
def test_o01_a_damaged_database_is_named(tmp_path: Path, where: int) -> None:
    path = tmp_path / "platform.sqlite"
    database = Database(f"sqlite:///{path}")
    database.migrate()
    Reports(database).keep("nao", {"run": "r-1"})
    database.close()
    data = bytearray(path.read_bytes())
    data[where : where + 8192] = b"\x5a" * 8192
    path.write_bytes(data)
    with pytest.raises(Invalid, match="restore a back-up"):
        Database(f"sqlite:///{path}").migrate()


@pytest.mark.parametrize("url", ["nonsense", "mysql://x/y", "postgresql+asyncpg://x/y"])
def test_other_databases_are_refused_without_repeating_the_url(url: str) -> None:
    with pytest.raises(Invalid) as caught:
        Database(url)
    assert url not in str(caught.value)


def test_a_server_away_is_unreachable_and_no_password_is_told(tmp_path: Path) -> None:
    with pytest.raises(Unreachable) as caught:
        Database(f"postgresql://rapp:geheim123@/rapp?host={tmp_path}", wait=1).migrate()
    assert "geheim123" not in str(caught.value)
