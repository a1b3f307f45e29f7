"""nginx of Debian's nginx-light with a configuration of its own on free ports, in no way the system's service."""

import getpass
import os
import socket
import ssl
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

NGINX = Path("/usr/sbin/nginx")
PATIENCE = 10.0  # s
_CONFIG = """
daemon off;
{user}
pid {folder}/nginx.pid;
worker_processes auto;
error_log stderr error;
events {{ worker_connections 1024; }}
http {{
    access_log off;
    sendfile on;
    tcp_nopush on;
    keepalive_requests 1000000000;
    default_type application/octet-stream;
    {temporary}
    server {{
        listen 127.0.0.1:{plain};
        listen 127.0.0.1:{tls} ssl;
        ssl_certificate {certificate};
        ssl_certificate_key {key};
        root {root};
    }}
}}
"""


@contextmanager
def nginx(folder: Path, root: Path, certificate: tuple[Path, Path]) -> Iterator[tuple[int, int, int]]:
    """One that serves the files below `root`, ended afterwards; gives its ports for plain HTTP and for TLS, and its id."""
    if not NGINX.exists():
        raise SystemExit("cannot measure nginx: it is not here; install Debian's nginx-light (./rapp bench store does it)")
    folder.mkdir()
    plain, tls = _free_ports(2)
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    temporary = "\n    ".join(f"{kind}_temp_path {folder}/{kind};" for kind in kinds)
    file = folder / "nginx.conf"
    user = f"user {getpass.getuser()};" if os.geteuid() == 0 else ""  # else its workers may not read the store
    file.write_text(
        _CONFIG.format(
            user=user,
            folder=folder,
            temporary=temporary,
            plain=plain,
            tls=tls,
            certificate=certificate[0],
            key=certificate[1],
            root=root,
        )
    )
    process = subprocess.Popen([NGINX, "-p", folder, "-e", "stderr", "-c", file], stderr=subprocess.DEVNULL)
    try:
        _wait_for(plain, process)
        yield plain, tls, process.pid
    finally:
        process.terminate()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def trusting(certificate: Path) -> ssl.SSLContext:
    """What a client believes this certificate with."""
    return ssl.create_default_context(cafile=str(certificate))


def _free_ports(count: int) -> list[int]:
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [int(one.getsockname()[1]) for one in sockets]
    for one in sockets:
        one.close()
    return ports


def _wait_for(port: int, process: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + PATIENCE
    while process.poll() is None and time.monotonic() < deadline:
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
            return
        except OSError:
            time.sleep(0.05)
    raise SystemExit("cannot start nginx: it does not listen")
