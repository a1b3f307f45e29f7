"""Downloads of one package from the platform and from nginx, in turns, by the same client."""

import argparse
import asyncio
import hashlib
import ssl
import statistics
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import uvloop

from benchmarks.store_nginx import nginx, trusting
from benchmarks.store_stage import MEGABYTE, Platform, clock, cpu, family, millis, write_rapp


class Loader(asyncio.BufferedProtocol):
    """One keep-alive connection, one download after another."""

    def __init__(self, request: bytes, size: int) -> None:
        self.took: list[float] = []
        self.failed = ""
        self.seen = hashlib.sha256()
        self.checked = False
        self._request = request
        self._size = size
        self._buffer = memoryview(bytearray(MEGABYTE))

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)
        self._ask()

    def get_buffer(self, sizehint: int) -> memoryview:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        piece = self._buffer[:nbytes]
        if self._left is None:
            head, _, rest = bytes(piece).partition(b"\r\n\r\n")
            if not head.startswith(b"HTTP/1.1 200") or f"content-length: {self._size}".encode() not in head.lower():
                self.failed = head.decode("latin-1") or "no head came"
                self.transport.close()
                return
            self._left, piece = self._size, memoryview(rest)
        if not self.checked:
            self.seen.update(piece)
        self._left -= len(piece)
        if self._left == 0:
            self.took.append(clock() - self._began)
            self.checked = True
            self._ask()

    def connection_lost(self, exc: Exception | None) -> None:
        self.failed = self.failed or f"the connection was cut: {exc}"

    def _ask(self) -> None:
        self._left: int | None = None
        self._began = clock()
        self.transport.write(self._request)


@dataclass
class Row:
    """One server with or without TLS."""

    name: str
    port: int
    pids: list[int]
    tls: ssl.SSLContext | None
    rates: list[float] = field(default_factory=list)
    took: list[float] = field(default_factory=list)
    used: float = 0.0

    def line(self, other: "Row") -> str:
        shares = statistics.median(mine / theirs for mine, theirs in zip(self.rates, other.rates, strict=True))
        each = 1000 * self.used / len(self.took)
        return f"{self.name:<26}{statistics.median(self.rates):>11.0f}{shares:>8.2f}{millis(self.took)}{each:>12.2f}"


async def _load(row: Row, request: bytes, package: bytes, connections: int, seconds: float) -> None:
    loop = asyncio.get_running_loop()
    loaders = []
    for _ in range(connections):
        name = "127.0.0.1" if row.tls else None
        made = await loop.create_connection(
            lambda: Loader(request, len(package)), "127.0.0.1", row.port, ssl=row.tls, server_hostname=name
        )
        loaders.append(made[1])
    await asyncio.sleep(seconds / 4)
    for loader in loaders:
        loader.took.clear()
    used, began = cpu(row.pids), clock()
    await asyncio.sleep(seconds)
    spent = clock() - began
    row.used += cpu(row.pids) - used
    took = [one for loader in loaders for one in loader.took]
    failed = next((loader.failed for loader in loaders if loader.failed), "")
    for loader in loaders:
        loader.transport.close()
    if failed or any(loader.seen.digest() != hashlib.sha256(package).digest() for loader in loaders):
        raise SystemExit(f"cannot go on: {row.name}: {failed or 'other bytes came'}")
    row.rates.append(len(took) / spent)
    row.took += took


def measure(folder: Path, options: argparse.Namespace) -> None:
    """Print the table."""
    source = write_rapp(folder / "source", "large", size=MEGABYTE)
    plain, secure = Platform(folder / "plain"), Platform(folder / "secure")
    for platform in (plain, secure):
        platform.publish(source)
    files = (plain.certificate, plain.key)
    words = ("--certificate", str(secure.certificate), "--certificate-key", str(secure.key))
    with ExitStack() as stack:
        plain_port, tls_port, pid = stack.enter_context(nginx(folder / "nginx", plain.data, files))
        for platform, more in ((plain, ()), (secure, words)):
            stack.enter_context(platform.serving(*more))
        _compare(
            plain,
            [Row("nginx", plain_port, family(pid), None), Row("rapp-cloud", plain.port, [plain.pid], None)],
            options,
        )
        _compare(
            secure,
            [
                Row("nginx, TLS", tls_port, family(pid), trusting(plain.certificate)),
                Row("rapp-cloud, TLS", secure.port, [secure.pid], trusting(secure.certificate)),
            ],
            options,
        )


def _compare(platform: Platform, rows: list[Row], options: argparse.Namespace) -> None:
    (file,) = (platform.data / "tuf" / "targets").iterdir()
    package = file.read_bytes()
    request = f"GET /tuf/targets/{file.name} HTTP/1.1\r\nHost: 127.0.0.1\r\nAccept-Token: {platform.token}\r\n\r\n".encode()
    for _ in range(options.rounds):
        for row in rows:
            uvloop.run(_load(row, request, package, options.connections, options.seconds))
    title = f"{len(package) / 1e6:.2f} MB, {options.connections} connections"
    print(f"{title:<26}{'downloads/s':>11}{'share':>8}{'p50 ms':>9}{'p99 ms':>9}{'CPU ms each':>12}")
    for row in rows:
        print(row.line(rows[0]))
