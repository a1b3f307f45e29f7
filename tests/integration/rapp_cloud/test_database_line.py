"""A PostgreSQL elsewhere is spoken to with TLS and by its right name, or not at all."""

import socket
import threading
from pathlib import Path

import pytest
import sqlalchemy as sa

from fakes import postgres as pg
from rapp_cloud.database.engine import Database
from rapp_cloud.database.secrecy import secrecy_of
from rapp_cloud.tls import KEY, make_certificate
from rapp_hop.errors import Refused, Unreachable

STRICT = {"sslmode": "verify-full"}


@pytest.fixture(autouse=True)
def _no_settings_of_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("PGHOST", "PGHOSTADDR", "PGSERVICE", "PGSSLMODE", "PGSSLROOTCERT"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(
    ("rest", "wanted"),
    [
        ("rapp@/x", {}), ("rapp@/x?host=/run/postgresql", {}), ("rapp@127.0.0.1/x", {}), ("rapp@[::1]:5432/x", {}),
        ("rapp@localhost/x?sslmode=disable", {}), ("rapp@db.example/x", STRICT), ("rapp@192.0.2.1/x", STRICT),
        ("rapp@db.example/x?sslmode=verify-full", STRICT), ("rapp@localhost,db.example/x", STRICT),
        ("rapp@/x?host=/run:5432&host=db.example:5432", STRICT), ("rapp@localhost/x?hostaddr=192.0.2.1", STRICT),
        ("rapp@/x?service=home", STRICT),
    ],
)  # fmt: skip
def test_who_is_spoken_to_in_secret(rest: str, wanted: dict[str, str]) -> None:
    assert secrecy_of(sa.make_url(f"postgresql+psycopg://{rest}")) == wanted


def test_the_machine_s_own_settings_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PGHOST", "db.example")
    assert secrecy_of(sa.make_url("postgresql+psycopg://rapp@/x")) == STRICT
    assert secrecy_of(sa.make_url("postgresql+psycopg://rapp@localhost/x")) == {}
    monkeypatch.setenv("PGHOSTADDR", "192.0.2.1")
    assert secrecy_of(sa.make_url("postgresql+psycopg://rapp@localhost/x")) == STRICT


@pytest.mark.parametrize("mode", ["disable", "allow", "prefer", "require", "verify-ca"])
def test_less_is_refused(mode: str) -> None:
    with pytest.raises(Refused, match="write sslmode=verify-full") as caught:
        Database(f"postgresql://rapp:geheim@db.example/x?sslmode={mode}")
    assert "geheim" not in str(caught.value)


def test_a_server_without_tls_hears_nothing() -> None:
    heard: list[bytes] = []
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            line, _ = listening.accept()
            with line:
                line.settimeout(30)
                heard.append(line.recv(8))
                line.sendall(b"N")
                heard.append(line.recv(4096))

        server = threading.Thread(target=serve)
        server.start()
        port = listening.getsockname()[1]
        with pytest.raises(Unreachable):
            Database(f"postgresql://rapp:geheim@db.example:{port}/x?hostaddr=127.0.0.1&sslrootcert=system").check()
        server.join(30)
    assert heard == [bytes.fromhex("0000000804d2162f"), b""]  # it asks for TLS, and goes


def test_a_real_server_by_its_right_name_only(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    certificate = make_certificate(tmp_path, ["db.example"])
    with pg.postgres((certificate, tmp_path / KEY), port):
        rest = f"/postgres?hostaddr=127.0.0.1&sslrootcert={certificate}"
        database = Database(f"postgresql://rapp@db.example:{port}{rest}")
        with database.reading() as connection:
            mine = sa.text("SELECT ssl FROM pg_stat_ssl WHERE pid = pg_backend_pid()")
            assert connection.execute(mine).scalar() is True
        database.close()
        with pytest.raises(Unreachable, match=r"other\.example"):
            Database(f"postgresql://rapp@other.example:{port}{rest}").check()
