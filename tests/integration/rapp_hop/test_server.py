"""HOP over real sockets: the server with the client, and with callers who do not keep to the rules."""

import asyncio
import json
import socket
import threading
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from rapp_hop import client as client_module
from rapp_hop.client import HopClient
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
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


def test_call_with_names_defaults_and_any_json(tmp_path: Path) -> None:
    async def test(_: int, client: HopClient) -> None:
        value = {"text": 'żółw\n"', "list": [1, 2.5, None, True, {"deep": []}]}
        assert await client.call("echo", {"value": value, "times": 2}) == [value, value]
        assert await client.call("who") == "nao application/json"

    run(test, tmp_path)


def test_files_come_as_paths_and_are_gone_afterwards(tmp_path: Path) -> None:
    async def test(_: int, client: HopClient) -> None:
        (tmp_path / "voice.OGG").write_bytes(b"\r\n--x" * 100)
        found = await client.call("measure", {"label": "é"}, {"recording": tmp_path / "voice.OGG"})
        assert (found["bytes"], found["suffix"], found["label"]) == (500, ".ogg", "é")
        assert Path(found["path"]).is_relative_to(tmp_path / "uploads")
        assert list((tmp_path / "uploads").iterdir()) == []
        error = await failure(client.call("measure", {}, {"recording": tmp_path / "nowhere"}))
        assert isinstance(error, Refused)

    run(test, tmp_path)


def test_with_url_calls_back_once(tmp_path: Path) -> None:
    async def test(port: int, client: HopClient) -> None:
        results: asyncio.Queue[Any] = asyncio.Queue()
        client.with_url("/hop/echo", {"value": 1}, results.put_nowait, results.put_nowait, 5)
        assert await results.get() == [1]
        client.with_url(f"http://127.0.0.1:{port}/hop/unwilling", {}, results.put_nowait, results.put_nowait, 5)
        assert isinstance(await results.get(), Refused)
        assert results.empty()

    run(test, tmp_path)


def test_each_error_arrives_as_itself(tmp_path: Path) -> None:
    async def test(port: int, client: HopClient) -> None:
        cases: list[tuple[Awaitable[Any], type[HopError], int]] = [
            (client.call("unwilling"), Refused, 403),
            (client.call("nix"), Refused, 404),
            (client.call("broken"), Bug, 500),
            (client.call("strange"), Bug, 500),
            (client.call("echo", {"value": 1, "times": "x"}), Invalid, 400),
            (client.call("echo", {}), Invalid, 400),
            (client.call("measure", {"recording": "/etc/passwd"}), Invalid, 400),
            (HopClient(client.base_url, "wrong" * 5).call("who"), Refused, 401),
            (HopClient(client.base_url).call("who"), Refused, 401),
        ]
        for call, leaf, status in cases:
            error = await failure(call)
            assert (type(error), error.status) == (leaf, status)
            assert str(error).startswith("cannot ")
            assert "secret" not in str(error)
        assert isinstance(await failure(HopClient("http://127.0.0.1:1").call("x")), Unreachable)

    run(test, tmp_path)


def test_no_trace_and_no_software_name_on_the_wire(tmp_path: Path) -> None:
    async def test(port: int, _: HopClient) -> None:
        answer = await raw(port, head(2, name="broken") + b"{}")
        assert answer.startswith(b"HTTP/1.1 500")
        assert json.loads(answer.partition(b"\r\n\r\n")[2])["error"]["kind"] == "bug"
        for word in (b"secret", b"Traceback", b"RuntimeError", b"Tornado", b".py"):
            assert word not in answer

    run(test, tmp_path)


@pytest.mark.parametrize("body", [b"{", b"[]", b"\xff\xff", b"[" * 1000, b'{"value":NaN}', b'{"value":1,"value":2}'])
def test_h12_bad_bodies(tmp_path: Path, body: bytes) -> None:
    async def test(port: int, client: HopClient) -> None:
        assert (await raw(port, head(len(body)) + body)).startswith(b"HTTP/1.1 400")
        assert await client.call("echo", {"value": 1}) == [1]

    run(test, tmp_path)


def test_h01_body_too_large_is_refused_before_it_comes(tmp_path: Path) -> None:
    async def test(port: int, client: HopClient) -> None:
        answer = await raw(port, head(10**12, name="measure"))
        assert answer.startswith(b"HTTP/1.1 413")
        assert json.loads(answer.partition(b"\r\n\r\n")[2])["error"]["kind"] == "refused"
        (tmp_path / "big").write_bytes(bytes(5000))
        assert (await failure(client.call("measure", {}, {"recording": tmp_path / "big"}))).status == 413

    run(test, tmp_path)


def test_h01_body_too_large_in_pieces(tmp_path: Path) -> None:
    async def test(port: int, client: HopClient) -> None:
        start = head("x", name="measure").replace(b"Content-Length: x", b"Transfer-Encoding: chunked")
        answer = await raw(port, start + b"1000\r\n" + bytes(4096) + b"\r\n" + b"0\r\n\r\n")
        assert answer.startswith(b"HTTP/1.1 413")
        assert await client.call("echo", {"value": 1}) == [1]

    run(test, tmp_path)


def test_wrong_token_is_told_before_the_body_comes(tmp_path: Path) -> None:
    async def test(port: int, _: HopClient) -> None:
        assert (await raw(port, head(1000, token="x"))).startswith(b"HTTP/1.1 401")

    run(test, tmp_path)


OWN = f"Host: x\r\nAccept-Token: {TOKEN}\r\n"


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (f"PATCH /hop/echo HTTP/1.1\r\n{OWN}\r\n", b"405"),
        (f"DELETE /hop/echo HTTP/1.1\r\n{OWN}\r\n", b"405"),
        (f"POST /hop/../etc/passwd HTTP/1.1\r\n{OWN}Content-Length: 0\r\n\r\n", b"404"),
        ("GET / HTTP/1.1\r\nHost: x\r\n\r\n", b"404"),
        (f"POST /hop/echo HTTP/1.1\r\n{OWN}Content-Type: text/plain\r\nContent-Length: 2\r\n\r\n{{}}", b"400"),
        ("POST /hop/echo HTTP/1.1\r\nHost: x\r\nContent-Length: +5\r\n\r\n", b"40"),
        ("POST /hop/echo HTTP/1.1\r\nHost: x\r\nX: " + "y" * 70_000 + "\r\n\r\n", b"4"),
    ],
)
def test_h02_to_h11_requests_out_of_rule(tmp_path: Path, request_: str, status: bytes) -> None:
    async def test(port: int, client: HopClient) -> None:
        answer = await raw(port, request_.encode())
        assert answer == b"" or answer.startswith(b"HTTP/1.1 " + status)
        assert await client.call("echo", {"value": 1}) == [1]

    run(test, tmp_path)


def test_h03_a_body_that_never_ends_is_cut(tmp_path: Path) -> None:
    async def test(port: int, client: HopClient) -> None:
        answer = await raw(port, head(100) + b'{"value"')
        assert not answer.startswith(b"HTTP/1.1 200")
        assert await client.call("echo", {"value": 1}) == [1]

    run(test, tmp_path, limits=ServerLimits(body_timeout=0.3))


def test_one_slow_service_does_not_delay_another(tmp_path: Path) -> None:
    """All places of the slow one are taken and more wait; another service is answered before any of them may end."""
    gate = threading.Event()

    @service(concurrency=2)
    def slow() -> bool:
        return gate.wait(30)

    async def test(_: int, client: HopClient) -> None:
        waiting = [asyncio.create_task(client.call("slow")) for _ in range(12)]
        try:
            for _ in range(20):
                assert (await client.call("who")).startswith("nao")
                assert await client.call("echo", {"value": 1}) == [1]
            assert not any(task.done() for task in waiting)
        finally:
            gate.set()
        assert await asyncio.gather(*waiting) == [True] * 12

    run(test, tmp_path, slow)


def test_out_of_time_is_unreachable_and_the_place_comes_back(tmp_path: Path) -> None:
    gate = threading.Event()

    @service(concurrency=1, timeout=0.2)
    def slow() -> bool:
        return gate.wait(30)

    @service(timeout=0.2)
    async def slow_too() -> None:
        await asyncio.sleep(30)

    async def test(_: int, client: HopClient) -> None:
        for name in ("slow", "slow", "slow_too"):
            error = await failure(client.call(name))
            assert (type(error), error.status) == (Unreachable, 408)
        gate.set()
        while True:  # the overdue call holds its place until its thread has ended
            try:
                assert await client.call("slow") is True
                break
            except Unreachable:
                continue

    run(test, tmp_path, slow, slow_too)


def test_too_many_callers_are_turned_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rapp_hop.runner.QUEUE", 2)
    gate = threading.Event()

    @service(concurrency=1)
    def slow() -> bool:
        return gate.wait(30)

    async def test(_: int, client: HopClient) -> None:
        calls = [asyncio.create_task(client.call("slow")) for _ in range(8)]
        done, _pending = await asyncio.wait(calls, return_when=asyncio.FIRST_COMPLETED)
        gate.set()
        results = await asyncio.gather(*calls, return_exceptions=True)
        turned_away = [result for result in results if isinstance(result, Unreachable)]
        assert done
        assert turned_away and all(error.status == 503 for error in turned_away)
        assert results.count(True) == 8 - len(turned_away) >= 1

    run(test, tmp_path, slow)


def test_the_client_gives_up_in_time(tmp_path: Path) -> None:
    async def test(_: int, client: HopClient) -> None:
        assert isinstance(await failure(client.call("slow", timeout=0.2)), Unreachable)
        for timeout in (0, -1, float("nan"), float("inf")):
            assert isinstance(await failure(client.call("echo", {"value": 1}, timeout=timeout)), Invalid)

    @service
    async def slow() -> None:
        await asyncio.sleep(60)

    run(test, tmp_path, slow)


def test_available_services_describes_itself(tmp_path: Path) -> None:
    async def test(_: int, client: HopClient) -> None:
        found = {item["name"]: item for item in (await client.call("available_services"))["services"]}
        assert found["measure"]["parameters"][0] == {"name": "recording", "type": "a file", "required": True}
        assert found["echo"]["description"] == "Say it again."

    run(test, tmp_path)


class Line:
    """A server of one connection at a time that answers with given bytes."""

    def __init__(self, *pieces: bytes, endless: bytes = b"", pause: float = 0.0) -> None:
        self._pieces, self._endless, self._pause = pieces, endless, pause

    async def __aenter__(self) -> str:
        self._server = await asyncio.start_server(self._answer, "127.0.0.1", 0)
        return f"http://127.0.0.1:{self._server.sockets[0].getsockname()[1]}"

    async def __aexit__(self, *_: object) -> None:
        self._server.close()
        await self._server.wait_closed()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            await reader.readuntil(b"\r\n\r\n")
            for piece in self._pieces:
                writer.write(piece)
                await writer.drain()
            while self._endless:
                writer.write(self._endless)
                await writer.drain()
                await asyncio.sleep(self._pause)
        except ConnectionError:
            pass
        finally:
            writer.close()


CHUNKED = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"
CHUNK = b"1000\r\n" + bytes(4096) + b"\r\n"


@pytest.mark.parametrize(
    ("line", "leaf"),
    [
        (Line(CHUNKED, endless=CHUNK), Invalid),  # S09
        (Line(b"HTTP/1.1 200 OK\r\nContent-Length: 999999999\r\n\r\n"), Invalid),
        (Line(b"HTTP/1.1 200 OK\r\n\r\n", endless=bytes(4096)), Invalid),
        (Line(b"HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nhalf"), Unreachable),  # S11
        (Line(CHUNKED, CHUNK), Unreachable),
        (Line(b"HTTP/1.1 404 No\r\nContent-Length: 0\r\n\r\n"), Refused),
        (Line(b"HTTP/1.1 302 Go\r\nLocation: http://127.0.0.1:1/\r\nContent-Length: 0\r\n\r\n"), Refused),  # S16
        (Line(b"HTTP/1.1 503 No\r\nContent-Length: 0\r\n\r\n"), Unreachable),
        (Line(b"rubbish\r\n\r\n"), Unreachable),
    ],
)  # fmt: skip
def test_downloads_are_bounded(tmp_path: Path, line: Line, leaf: type[HopError]) -> None:
    async def main() -> None:
        async with line as url:
            client = HopClient(url, TOKEN)
            error = await failure(client.download("/x", tmp_path / "x", 10_000, timeout=20))
            assert type(error) is leaf
            assert not (tmp_path / "x").exists() or (tmp_path / "x").stat().st_size <= 10_000

    asyncio.run(main())


def test_s10_a_trickling_download_ends_in_time(tmp_path: Path) -> None:
    async def main() -> None:
        async with Line(b"HTTP/1.1 200 OK\r\nContent-Length: 9000\r\n\r\n", endless=b"x", pause=0.02) as url:
            error = await failure(HopClient(url).download("/x", tmp_path / "x", 10_000, timeout=0.5))
            assert isinstance(error, Unreachable)
        async with Line(b"HTTP/1.1 200 OK\r\n", endless=b"X: " + b"y" * 5000 + b"\r\n") as url:
            error = await failure(HopClient(url).download("/x", tmp_path / "x", 10_000, timeout=20))
            assert isinstance(error, Invalid)

    asyncio.run(main())


def test_a_download_of_which_nothing_comes_ends_before_its_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rapp_hop.client.IDLE", 0.5)

    async def main() -> None:
        half = b"HTTP/1.1 200 OK\r\nContent-Length: 9000\r\n\r\nhalf"
        async with Line(half, endless=b"x", pause=1000) as url, asyncio.timeout(20):
            error = await failure(HopClient(url).download("/x", tmp_path / "x", 10_000, timeout=1000))
            assert isinstance(error, Unreachable)
        slow = Line(b"HTTP/1.1 200 OK\r\nContent-Length: 8\r\n\r\n", endless=b"x", pause=0.1)
        async with slow as url:
            assert await HopClient(url).download("/x", tmp_path / "x", 10_000, timeout=1000) == 8

    asyncio.run(main())


def test_a_download_tells_its_progress_and_a_full_disk(tmp_path: Path) -> None:
    async def main() -> None:
        told: list[tuple[int, int | None]] = []
        async with Line(b"HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhello") as url:
            client = HopClient(url)
            assert await client.download("/x", tmp_path / "x", 5, on_progress=lambda *all_: told.append(all_)) == 5
            assert (tmp_path / "x").read_bytes() == b"hello"
            assert told[-1] == (5, 5)
            with Path("/dev/full").open("wb", buffering=0) as full, pytest.raises(OSError, match="No space"):
                await client.download("/x", full.write, 5)

    asyncio.run(main())


def test_the_token_goes_to_its_own_platform_only(tmp_path: Path) -> None:
    async def main() -> None:
        seen: list[bytes] = []

        async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            seen.append(await reader.readuntil(b"\r\n\r\n"))
            writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{}")
            await writer.drain()
            writer.close()

        server = await asyncio.start_server(answer, "127.0.0.1", 0)
        async with server:
            port = server.sockets[0].getsockname()[1]
            own, foreign = HopClient(f"http://127.0.0.1:{port}", TOKEN), HopClient("http://127.0.0.1:1", TOKEN)
            await own.call("x")
            done: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
            foreign.with_url(f"http://127.0.0.1:{port}/hop/x", {}, done.set_result, done.set_exception)
            await done
        assert [TOKEN.encode() in head_ for head_ in seen] == [True, False]

    asyncio.run(main())


def test_an_answer_that_is_not_json_or_too_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async def main() -> None:
        for answer in (b"<html>", b'{"a":NaN}', b""):
            async with Line(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(answer) + answer) as url:
                assert isinstance(await failure(HopClient(url).call("x")), Invalid)
        async with Line(b"HTTP/1.1 500 Oh\r\nContent-Length: 6\r\n\r\n<html>") as url:
            assert isinstance(await failure(HopClient(url).call("x")), Bug)
        monkeypatch.setattr(client_module, "MAX_ANSWER", 1000)
        async with Line(b"HTTP/1.1 200 OK\r\nContent-Length: 2000\r\n\r\n", b" " * 2000) as url:
            assert isinstance(await failure(HopClient(url).call("x")), Unreachable | Invalid)

    asyncio.run(main())
