"""HOP over real sockets: the server with the client, and with callers who do not keep to the rules."""

import asyncio
import json
import threading
from collections.abc import Awaitable
from pathlib import Path
from typing import Any

import pytest

from fakes.echoing import TOKEN, failure, head, raw, run
from rapp_hop.client import HopClient
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_hop.server import ServerLimits
from rapp_hop.service import service


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
