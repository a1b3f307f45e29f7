"""A caller who sends all before he reads gets the answer, whatever becomes of what he sends; with TLS too."""

import asyncio
import http.client
import socket
import ssl
from pathlib import Path

import pytest

from fakes.hop_house import TOKEN, House, request, visit
from rapp_cloud.tls import make_certificate, server_tls
from rapp_hop import connection
from rapp_hop.registry import ServiceRegistry
from rapp_hop.server import HopServer
from rapp_hop.service import service

TIMES = 3  # a connection that is reset shows itself not each time
PARTS = 'multipart/form-data; boundary="b"'


@service(max_body=2**20)
def measure(file: Path) -> int:
    """Say how long a file is."""
    return file.stat().st_size


def post(port: int, certificate: Path | None, path: str, body: bytes, kind: str = "application/json") -> tuple[int, bool]:
    """Send all, then read; gives the status and whether the caller may come again."""
    line = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    if certificate is not None:
        trust = ssl.create_default_context(cafile=certificate)
        line = http.client.HTTPSConnection("127.0.0.1", port, timeout=30, context=trust)
    headers = {"Accept-Token": TOKEN, "Accept": "application/json", "Content-Type": kind, "Connection": "close"}
    line.request("POST", path, body, headers)
    answer = line.getresponse()
    answer.read()
    line.close()
    return answer.status, "Retry-After" in answer.headers


def with_file(size: int) -> bytes:
    head = b'--b\r\nContent-Disposition: form-data; name="file"; filename="a.bin"\r\n\r\n'
    return head + b"x" * size + b"\r\n--b--\r\n"


@pytest.mark.parametrize("tls", [False, True], ids=["plain", "tls"])
def test_h01_who_sends_too_much_is_told_so(tmp_path: Path, tls: bool) -> None:
    async def main() -> None:
        certificate = make_certificate(tmp_path / "tls", ["127.0.0.1"]) if tls else None
        context = server_tls(certificate, certificate.with_name("key.pem")) if certificate is not None else None
        server = HopServer(ServiceRegistry([measure]), {TOKEN: "nao"}.get, tmp_path / "uploads", tls=context)
        port = server.listen(0)
        for path, status in (("/hop/measure", 413), ("/hop/nix", 404)):
            for _ in range(TIMES):
                assert (await asyncio.to_thread(post, port, certificate, path, bytes(12 * 2**20)))[0] == status
        await server.close()

    asyncio.run(main())


def test_a_server_does_not_read_for_ever(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither in bytes, nor in time."""

    def send_without_end(port: int) -> None:
        with socket.create_connection(("127.0.0.1", port), 10) as line:
            line.sendall(request(body=b"").replace(b"Content-Length: 0", b"Content-Length: 9999999999999"))
            while True:
                line.sendall(bytes(2**20))

    def wait(port: int) -> bytes:
        with socket.create_connection(("127.0.0.1", port), 30) as line:
            line.sendall(request(body=b"").replace(b"Content-Length: 0", b"Content-Length: 9999999999999"))
            while not (answer := line.recv(4096)).endswith(b"}"):
                assert answer
            assert line.recv(4096) == b""
            while True:
                line.sendall(b"x")

    async def test(house: House) -> None:
        with pytest.raises(ConnectionError):
            await asyncio.to_thread(send_without_end, house.port)
        monkeypatch.setattr(connection, "LINGER", 0.2)
        with pytest.raises(ConnectionError):
            await asyncio.to_thread(wait, house.port)
        assert await house.alive()

    visit(test, tmp_path)


@pytest.mark.parametrize("size", [1000, 2**19], ids=["in memory", "on the disk"])
def test_a_bad_disk_is_told_and_the_call_may_come_again(tmp_path: Path, size: int) -> None:
    async def main() -> None:
        (tmp_path / "no folder").write_text("")
        server = HopServer(ServiceRegistry([measure]), {TOKEN: "nao"}.get, tmp_path / "no folder" / "uploads")
        port = server.listen(0)
        assert await asyncio.to_thread(post, port, None, "/hop/measure", with_file(size), PARTS) == (503, True)
        await server.close()

    asyncio.run(main())
