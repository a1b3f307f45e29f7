"""A HOP server with a few services, for tests; and a line to it on which any bytes can be sent."""

import asyncio
import json
import socket
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rapp_hop.client import HopClient
from rapp_hop.registry import ServiceRegistry
from rapp_hop.results import File, Stream
from rapp_hop.server import HopServer, ServerLimits
from rapp_hop.service import Request, Service, service

TOKEN = "token-of-nao-0123456789"
OTHER = "token-of-ann-0123456789"
PATIENCE = 20.0  # s
FORM = "application/x-www-form-urlencoded"


@dataclass
class Answer:
    """One answer as it came."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class House:
    """Services that remember how often they ran, and their server."""

    def __init__(self, folder: Path, limits: ServerLimits | None, more: tuple[Service, ...]) -> None:
        self.ran = 0
        self.folder = folder
        self.server = HopServer(
            ServiceRegistry([*self._services(), *more]), {TOKEN: "nao", OTHER: "ann"}.get, folder / "uploads", limits=limits
        )
        self.port = self.server.listen(0)
        self.client = HopClient(f"http://127.0.0.1:{self.port}", TOKEN)

    async def send(self, *pieces: bytes, half_close: bool = False) -> bytes:
        """Send bytes and return all that comes until the server closes, or has answered and is silent."""
        return await asyncio.to_thread(talk, self.port, pieces, half_close)

    async def ask(self, data: bytes, half_close: bool = False) -> Answer:
        """Send one request and return its answer."""
        return read_answer(await self.send(data, half_close=half_close))

    async def alive(self) -> bool:
        """Whether another caller is served as ever."""
        return bool(await self.client.call("echo", {"value": [1]}) == [1])

    def _services(self) -> list[Service]:  # noqa: C901 (a list)
        @service
        async def echo(value: Any) -> Any:
            """Say it again."""
            self.ran += 1
            return value

        @service
        def add(a: int, b: int = 1) -> int:
            self.ran += 1
            return a + b

        @service(max_body=3 * 2**20, blank={"size": -1})
        def measure(file: Path, label: str = "") -> dict[str, Any]:
            self.ran += 1
            return {"size": file.stat().st_size, "suffix": file.suffix, "label": label}

        @service
        def who(request: Request) -> str:
            self.ran += 1
            return f"{request.caller} {request.method}"

        @service
        def broken() -> None:
            self.ran += 1
            raise RuntimeError("secret of the house")

        @service
        def numbers(count: int) -> File:
            path = self.folder / "numbers.txt"
            path.write_bytes(b"0123456789" * count)
            return File(path, "text/plain", "numbers.txt", remove=True)

        @service
        async def drip(count: int, fail: bool = False) -> Stream:
            async def pieces() -> AsyncGenerator[bytes, None]:
                for number in range(count):
                    yield b"%d;" % number
                    await asyncio.sleep(0)
                if fail:
                    raise RuntimeError("secret of the stream")

            return Stream(pieces(), "text/plain")

        return [echo, add, measure, who, broken, numbers, drip]


@asynccontextmanager
async def house(folder: Path, *more: Service, limits: ServerLimits | None = None) -> AsyncGenerator[House, None]:
    """A house that is open while the block runs."""
    one = House(folder, limits, more)
    try:
        yield one
    finally:
        await one.client.close()
        await one.server.close()


def visit(test: Callable[[House], Awaitable[None]], folder: Path, *more: Service, limits: ServerLimits | None = None) -> None:
    """Run a test in a house."""

    async def main() -> None:
        async with asyncio.timeout(90), house(folder, *more, limits=limits) as one:
            await test(one)

    asyncio.run(main())


def talk(port: int, pieces: tuple[bytes, ...], half_close: bool = False) -> bytes:
    """Send pieces; return what comes until the end, or until as many answers as requests were whole."""
    with socket.create_connection(("127.0.0.1", port), PATIENCE) as line:
        line.settimeout(PATIENCE)
        answer = b""
        try:
            for piece in pieces:
                line.sendall(piece)
            if half_close:
                line.shutdown(socket.SHUT_WR)
        except ConnectionError:
            pass  # the server has said enough already
        try:
            while piece := line.recv(65536):
                answer += piece
        except ConnectionError:
            pass
        return answer


def request(
    path: str = "/hop/echo", body: bytes = b'{"value": 1}', *lines: str, method: str = "POST", kind: str = "application/json",
    token: str = TOKEN, keep: bool = False,
) -> bytes:  # fmt: skip
    """A request as bytes; more header lines may be given."""
    head = [f"{method} {path} HTTP/1.1", "Host: house", *([f"Accept-Token: {token}"] if token else []), *lines]
    head += [f"Content-Type: {kind}"] * bool(kind) + [f"Content-Length: {len(body)}"] + ["Connection: close"] * (not keep)
    return ("\r\n".join(head) + "\r\n\r\n").encode("latin-1") + body


def read_answer(data: bytes) -> Answer:
    """Read one answer with its whole body."""
    found = read_answers(data)
    assert len(found) == 1, data[:500]
    return found[0]


def read_answers(data: bytes) -> list[Answer]:
    """Read answers that follow each other."""
    found = []
    while data:
        head, blank, data = data.partition(b"\r\n\r\n")
        assert blank, head
        first, *lines = head.decode("latin-1").split("\r\n")
        headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
        length = int(headers["content-length"])
        assert len(data) >= length
        found.append(Answer(int(first.split()[1]), headers, data[:length]))
        data = data[length:]
    return found
