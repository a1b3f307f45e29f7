"""The store as `hophz` sees it: what it asks for, in the bytes it uses (Hop half-closes its connection after a request)."""

import asyncio
import io
import re
import socket
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from fakes.packages import source_folder
from rapp_cloud.shelf import Shelf
from rapp_cloud.weblets import weblets
from rapp_hop.hz.archive import build
from rapp_hop.registry import ServiceRegistry
from rapp_hop.server import HopServer


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    shelf = Shelf(tmp_path / "tuf", tmp_path / "keys")
    shelf.create()
    for version in ("1.0.0", "1.1.0"):
        shelf.publish(build(source_folder(tmp_path, version=version)))
    cloud = {"agent": "cloud", "keywords": {}, "sentences": {}, "permissions": {"core": [], "cloud": []}}
    shelf.publish(build(source_folder(tmp_path, "hello_cloud", **cloud)))
    shelf.publish(build(source_folder(tmp_path, "secret")), robots=("nao1",))
    return shelf


@contextmanager
def asked(port: int, path: str) -> Iterator[tuple[bytes, bytes]]:
    with socket.create_connection(("127.0.0.1", port), 10) as line:
        line.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode())
        line.shutdown(socket.SHUT_WR)
        head, _, body = b"".join(iter(lambda: line.recv(65536), b"")).partition(b"\r\n\r\n")
    yield head, body


def get(port: int, path: str) -> tuple[int, bytes]:
    with asked(port, path) as (head, body):
        length = re.search(rb"(?i)content-length: (\d+)", head)
        assert length is not None and int(length[1]) == len(body)
        return int(head.split()[1]), body


def test_hophz_updates_finds_and_installs(shelf: Shelf, tmp_path: Path) -> None:
    async def main() -> None:
        server = HopServer(ServiceRegistry([]), lambda _: None, tmp_path / "uploads", [weblets(shelf, "http")])
        try:
            await asyncio.to_thread(use, server.listen(0))
        finally:
            await server.close()

    def use(port: int) -> None:
        status, listed = get(port, "/hop/weblets/synclist")
        text = listed.decode()
        assert status == 200
        assert text.count("(url ") == 1 and "cloud" not in text and "secret" not in text
        url = re.search(r'\(url "http://127\.0\.0\.1:\d+([^"]+)"\) \(name "hello"\) \(version "1\.1\.0"\)', text)
        assert url is not None
        status, package = get(port, url[1])
        assert status == 200
        with tarfile.open(fileobj=io.BytesIO(package), mode="r:gz") as tar:
            info = tar.extractfile("hello/etc/weblet.info")
            assert info is not None and info.read().startswith(b'((name "hello") (version "1.1.0")')
        for pattern, found in [("hello-*.hz", b"hello-1.1.0.hz"), ("hello-1.0.*.hz", b"hello-1.0.0.hz"), ("nix-*.hz", b"")]:
            assert get(port, f"/hop/weblets/resolve?weblet={pattern}") == (200, found)
        for path in [
            "download?weblet=hello-2.0.0.hz", "download?weblet=secret-1.0.0.hz", "download?weblet=../../keys/root.pem",
            "download?weblet=%2e%2e%2fkeys", "list", "",
        ]:  # fmt: skip
            assert get(port, f"/hop/weblets/{path}")[0] == 404
        for path in ["download", "download?weblet=a&weblet=b", "resolve?weblet=" + "x" * 300]:
            assert get(port, f"/hop/weblets/{path}")[0] == 400

    asyncio.run(main())
