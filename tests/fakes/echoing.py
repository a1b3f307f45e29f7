"""A HOP server with small services, a client of it, and requests made by hand."""

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Refused
from rapp_hop.registry import ServiceRegistry
from rapp_hop.server import HopServer, ServerLimits
from rapp_hop.service import Request, Service, service

TOKEN = "t" * 20


@service
async def echo(value: Any, times: int = 1) -> list[Any]:
    """Say it again."""
    return [value] * times


@service
def who(request: Request) -> str:
    return f"{request.caller} {request.headers['content-type']}"


@service(max_body=2000)
def measure(recording: Path, label: str = "") -> dict[str, Any]:
    return {"bytes": recording.stat().st_size, "suffix": recording.suffix, "label": label, "path": str(recording)}


@service
def broken() -> None:
    raise RuntimeError("secret of the house")


@service
async def strange() -> object:
    return object()


@service
def unwilling() -> None:
    raise Refused("cannot do this: ask for something else")


def run(
    test: Callable[[int, HopClient], Awaitable[None]], tmp_path: Path, *more: Service, limits: ServerLimits | None = None
) -> None:
    async def main() -> None:
        async with serving(tmp_path, *more, limits=limits) as port:
            client = HopClient(f"http://127.0.0.1:{port}", TOKEN)
            try:
                await test(port, client)
            finally:
                await client.close()

    asyncio.run(main())


@asynccontextmanager
async def serving(tmp_path: Path, *more: Service, limits: ServerLimits | None = None) -> AsyncIterator[int]:
    registry = ServiceRegistry([echo, who, measure, broken, strange, unwilling, *more])
    server = HopServer(registry, {TOKEN: "nao"}.get, tmp_path / "uploads", limits=limits)
    try:
        yield server.listen(0)
    finally:
        await server.close()


async def failure(call: Awaitable[Any]) -> HopError:
    with pytest.raises(HopError) as caught:
        await call
    return caught.value


async def raw(port: int, data: bytes) -> bytes:
    """Send bytes and return all that comes back until the server closes or is silent."""

    def talk() -> bytes:
        with socket.create_connection(("127.0.0.1", port), 5) as line:
            line.settimeout(2)
            answer = b""
            try:
                line.sendall(data)
                while piece := line.recv(65536):
                    answer += piece
                    head, blank, body = answer.partition(b"\r\n\r\n")
                    lengths = [int(x[15:]) for x in head.split(b"\r\n") if x.lower().startswith(b"content-length:")]
                    if blank and lengths and len(body) >= lengths[0]:
                        break
            except (TimeoutError, ConnectionError):
                pass
            return answer

    return await asyncio.to_thread(talk)


def head(length: int | str, *, name: str = "echo", token: str = TOKEN, kind: str = "application/json") -> bytes:
    line = f"POST /hop/{name} HTTP/1.1\r\nHost: x\r\nAccept-Token: {token}\r\n"
    return f"{line}Content-Type: {kind}\r\nContent-Length: {length}\r\n\r\n".encode()
