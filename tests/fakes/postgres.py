"""A PostgreSQL of the tests' own: Debian's server in a temporary folder, reached by a UNIX socket, gone at the end."""

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import sqlalchemy as sa

ACCOUNT = "postgres"  # Debian's; the server refuses to run as root
PATIENCE = 60.0  # s


def _binaries() -> Path:
    return max(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda path: float(path.parent.name))


def _as_account(words: list[str]) -> list[str]:
    """The words of a process that ends with us and is not root."""
    setpriv = ["setpriv", "--pdeathsig", "INT"]
    if os.geteuid() == 0:
        setpriv += ["--reuid", ACCOUNT, "--regid", ACCOUNT, "--clear-groups"]
    return [*setpriv, "--", *words]


@contextmanager
def postgres(tls: tuple[Path, Path] | None = None, port: int = 5432) -> Iterator[str]:
    """Start one; gives the URL of its server, without a database. With `tls` (certificate, key) it listens on 127.0.0.1 too."""
    with tempfile.TemporaryDirectory(prefix="rapp-pg-", dir="/tmp") as name:
        folder = Path(name)
        data = folder / "data"
        if os.geteuid() == 0:
            shutil.chown(folder, ACCOUNT, ACCOUNT)
        line = _tls(folder, *tls) if tls else ["listen_addresses="]
        initdb = [str(_binaries() / "initdb"), "--auth=trust", "--username=rapp", "--no-sync", "--encoding=UTF8", "-D", str(data)]
        subprocess.run(_as_account(initdb), check=True, capture_output=True, timeout=PATIENCE, cwd="/")
        settings = [
            f"unix_socket_directories={folder}",
            *line,
            f"port={port}",
            "fsync=off",
            "max_connections=40",
            "shared_buffers=16MB",
        ]
        words = [str(_binaries() / "postgres"), "-D", str(data), *(word for item in settings for word in ("-c", item))]
        log = folder / "log"
        with log.open("wb") as errors:
            server = subprocess.Popen(_as_account(words), stdin=subprocess.DEVNULL, stdout=errors, stderr=errors, cwd="/")
        try:
            url = f"postgresql+psycopg://rapp@/{{}}?host={folder}&port={port}"
            _wait(server, url.format("postgres"), log)
            yield url
        finally:
            server.send_signal(signal.SIGINT)  # it sends clients away and ends
            try:
                server.wait(PATIENCE)
            finally:
                server.kill()
                server.wait()


@contextmanager
def database(server: str, name: str) -> Iterator[str]:
    """Make a database on it; gives its URL."""
    engine = sa.create_engine(server.format("postgres"), isolation_level="AUTOCOMMIT")
    try:
        with engine.connect() as connection:
            connection.execute(sa.text(f"CREATE DATABASE {name}"))
        yield server.format(name)
        with engine.connect() as connection:
            connection.execute(sa.text(f"DROP DATABASE {name} WITH (FORCE)"))
    finally:
        engine.dispose()


def _tls(folder: Path, *files: Path) -> list[str]:
    """The settings for TLS, with files that the server's account may read."""
    for file in files:
        copy = shutil.copy(file, folder)
        if os.geteuid() == 0:
            shutil.chown(copy, ACCOUNT, ACCOUNT)
    certificate, key = (folder / file.name for file in files)
    return ["listen_addresses=127.0.0.1", "ssl=on", f"ssl_cert_file={certificate}", f"ssl_key_file={key}"]


def _wait(server: subprocess.Popen[bytes], url: str, log: Path) -> None:
    engine = sa.create_engine(url)
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            with engine.connect():
                engine.dispose()
                return
        except sa.exc.OperationalError:
            assert server.poll() is None and time.monotonic() < deadline, log.read_text()
            time.sleep(0.05)
