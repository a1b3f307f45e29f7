"""Bad callers, H14 to H20 of the project's list of hostile inputs: tokens, floods, hanging up, time-outs, other sites.

And what becomes of errors.
"""

import asyncio
import json
import socket
from pathlib import Path
from typing import Any

import pytest

from fakes.hop_house import FORM, OTHER, TOKEN, House, read_answers, request, visit
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_hop.results import Stream
from rapp_hop.server import ServerLimits
from rapp_hop.service import Request, service


@pytest.mark.parametrize(
    "lines",
    [
        (),
        ("Accept-Token:",),
        (f"Accept-Token: {TOKEN[:-1]}",),
        (f"Accept-Token: {TOKEN}x",),
        (f"Accept-Token: {TOKEN.upper()}",),
        (f"Accept-Token: Bearer {TOKEN}",),
        (f"Accept-Token: {TOKEN}", f"Accept-Token: {OTHER}"),
        (f"Accept-Token: {TOKEN}", f"Authorization: Bearer {OTHER}"),
        (f"Accept-Token: {TOKEN}", "Authorization: none"),
        ("Authorization: none",),
        (f"Authorization: {TOKEN}",),
        (f"Authorization: Digest {TOKEN}",),
        ("Authorization: Basic !!!",),
        ("Authorization: Basic bm9uZQ==",),
        ("Authorization: Bearer eyJhbGciOiJub25lIn0.e30.",),
        (f"Cookie: token={TOKEN}",),
    ],
)
def test_h14_tokens_that_name_nobody(tmp_path: Path, lines: tuple[str, ...]) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(request("/hop/who", b"{}", *lines, token=""))
        assert answer.status == (400 if sum(line.startswith("Accept-Token") for line in lines) == 2 else 401)
        assert house.ran == 0

    visit(test, tmp_path)


def test_h14_schemes_in_any_case_name_the_caller(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        for scheme in ("Bearer", "bearer", "BEARER"):
            answer = await house.ask(request("/hop/who", b"{}", f"Authorization: {scheme} {OTHER}", token=""))
            assert answer.json == "ann POST"

    visit(test, tmp_path)


def test_h15_a_flood_of_one_caller_leaves_the_others_served(tmp_path: Path) -> None:
    """The bucket does not fill again in this test, so that no clock decides."""

    async def test(house: House) -> None:
        flood = request(keep=True) * 200 + request()
        other = HopClient(f"http://127.0.0.1:{house.port}", OTHER)
        flooding = [asyncio.create_task(house.send(flood)) for _ in range(5)]
        for _ in range(20):
            assert await other.call("who") == "ann POST"
        answers = [answer for data in await asyncio.gather(*flooding) for answer in read_answers(data)]
        turned_away = [answer for answer in answers if answer.status == 429]
        assert len(answers) == 5 * 201
        assert [answer.status for answer in answers].count(200) == 50 == house.ran - 20
        assert len(turned_away) == len(answers) - 50
        assert turned_away[0].json["error"]["kind"] == "unreachable" and turned_away[0].headers["retry-after"] == "1"
        await other.close()

    visit(test, tmp_path, limits=ServerLimits(rate=1e-6, burst=50))


def test_h15_too_many_connections_are_told_so(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        lines = [socket.create_connection(("127.0.0.1", house.port), 10) for _ in range(5)]
        for line in lines:
            line.sendall(b"P")
        assert (await house.ask(request())).status == 503
        for line in lines:
            line.close()
        async with asyncio.timeout(20):
            while (await house.ask(request())).status != 200:
                await asyncio.sleep(0.01)

    visit(test, tmp_path, limits=ServerLimits(connections_of_one=5))


def test_h15_bodies_have_bounded_room_together(tmp_path: Path) -> None:
    """Who finds none is turned away and may come again; who goes gives back what he took."""

    async def test(house: House) -> None:
        body = b'{"value": "' + b"x" * 600_000 + b'"}'
        with socket.create_connection(("127.0.0.1", house.port), 10) as hoarder:
            hoarder.sendall(request(body=body)[:-2])
            async with asyncio.timeout(20):
                while (answer := await house.ask(request(body=body))).status == 200:
                    await asyncio.sleep(0.01)  # until what the hoarder sent has been read
            assert answer.status == 503 and answer.headers["retry-after"]
            assert answer.json["error"]["kind"] == "unreachable"
        async with asyncio.timeout(20):
            while (await house.ask(request(body=body))).status != 200:
                await asyncio.sleep(0.01)

    visit(test, tmp_path, limits=ServerLimits(spooled=2**20))


def test_h16_callers_who_hang_up_in_the_middle_of_the_answer(tmp_path: Path) -> None:
    closed = asyncio.Event()

    @service
    async def endless() -> Stream:
        async def pieces() -> Any:
            try:
                while True:
                    yield b"x" * 65536
                    await asyncio.sleep(0)
            finally:
                closed.set()

        return Stream(pieces())

    async def test(house: House) -> None:
        for name in ("endless", "echo", "numbers"):
            body = {"endless": b"{}", "echo": b'{"value": 1}', "numbers": b'{"count": 90000}'}[name]
            line = socket.create_connection(("127.0.0.1", house.port), 10)
            line.sendall(request(f"/hop/{name}", body))
            if name == "endless":
                await asyncio.to_thread(line.recv, 10)
            line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # a reset, not a farewell
            line.close()
        async with asyncio.timeout(20):
            await closed.wait()
            while (house.folder / "numbers.txt").exists():  # removed, although nobody took it
                await asyncio.sleep(0.01)
        assert await house.alive()

    visit(test, tmp_path, endless)


def test_h16_a_caller_who_reads_nothing_is_given_up(tmp_path: Path) -> None:
    closed = asyncio.Event()

    @service
    async def endless() -> Stream:
        async def pieces() -> Any:
            try:
                while True:
                    yield b"x" * 65536
            finally:
                closed.set()

        return Stream(pieces())

    async def test(house: House) -> None:
        with socket.create_connection(("127.0.0.1", house.port), 10) as line:
            line.sendall(request("/hop/endless", b"{}"))
            async with asyncio.timeout(20):
                await closed.wait()
        assert await house.alive()

    visit(test, tmp_path, endless, limits=ServerLimits(send_timeout=0.3))


def test_h17_the_same_request_id_runs_once(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        key = "Idempotency-Key: 0123456789abcdef"
        data = request("/hop/add", b'{"a": 1}', key)
        answers = await asyncio.gather(*(house.ask(data) for _ in range(10)))
        assert {answer.body for answer in answers} == {b"2"} and house.ran == 1
        assert (await house.ask(request("/hop/add", b'{"a": 2}', key))).status == 409
        assert (await house.ask(request("/hop/add", b'{"a": 2}', key, token=OTHER))).json == 3
        assert (await house.ask(request("/hop/add", b'{"a": 1}', "Idempotency-Key: x"))).status == 400
        assert (await house.ask(request("/hop/add", b'{"a": 1}', key, "Idempotency-Key: another-key"))).status == 400
        assert house.ran == 2

    visit(test, tmp_path)


@pytest.mark.parametrize("seconds", [0, -1, float("nan"), float("inf"), 10 * 365 * 24 * 3600.0])
def test_h18_time_outs_that_are_none(tmp_path: Path, seconds: float) -> None:
    async def test(house: House) -> None:
        with pytest.raises(Invalid, match="within"):
            await house.client.call("echo", {"value": 1}, timeout=seconds)
        with pytest.raises((ValueError, Invalid)):
            service(timeout=seconds)(lambda: None)
        assert house.ran == 0

    visit(test, tmp_path)


def test_h18_no_header_of_a_caller_changes_a_service_s_time(tmp_path: Path) -> None:
    @service(timeout=0.2)
    async def slow() -> None:
        await asyncio.sleep(60)

    async def test(house: House) -> None:
        lines = ("Timeout: 9999", "Hop-Timeout: -1", "Keep-Alive: timeout=9999", "X-Timeout: 315360000")
        answer = await house.ask(request("/hop/slow", b"{}", *lines))
        assert (answer.status, answer.json["error"]["kind"]) == (408, "unreachable")

    visit(test, tmp_path, slow)


def test_h19_no_redirect_leads_the_client_elsewhere(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        seen: list[bytes] = []

        async def redirect(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            seen.append(await reader.readuntil(b"\r\n\r\n"))
            writer.write(
                f"HTTP/1.1 307 Go\r\nLocation: http://127.0.0.1:{house.port}/hop/who\r\nContent-Length: 0\r\n\r\n".encode()
            )
            await writer.drain()
            writer.close()

        async with await asyncio.start_server(redirect, "127.0.0.1", 0) as server:
            client = HopClient(f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}", TOKEN)
            with pytest.raises(Refused, match="HTTP 307"):
                await client.call("who")
            await client.close()
        assert len(seen) == 1 and house.ran == 0

    visit(test, tmp_path)


def test_h19_no_line_end_gets_into_an_answer_s_headers(tmp_path: Path) -> None:
    @service
    async def named(name: str, kind: str) -> Stream:
        return Stream([b"x"], kind, name)

    async def test(house: House) -> None:
        arguments = {"name": "a\r\nSet-Cookie: x=1\r\n.txt", "kind": "text/plain"}
        data = await house.send(request("/hop/named", json.dumps(arguments).encode()))
        assert data.startswith(b"HTTP/1.1 200 ") and b"\r\nSet-Cookie" not in data
        arguments = {"name": "a", "kind": "text/plain\r\nSet-Cookie: x=1"}
        data = await house.send(request("/hop/named", json.dumps(arguments).encode()))
        assert b"\r\nSet-Cookie" not in data and not data.startswith(b"HTTP/1.1 200")
        assert await house.alive()

    visit(test, tmp_path, named)


@pytest.mark.parametrize(
    "lines",
    [
        ("Origin: http://elsewhere",),
        ("Origin: null",),
        ("Origin: http://house.elsewhere",),
        ("Sec-Fetch-Site: cross-site",),
        ("Origin: http://house", "Sec-Fetch-Site: cross-site"),
    ],
)
def test_h20_other_sites_pages_may_not_call(tmp_path: Path, lines: tuple[str, ...]) -> None:
    async def test(house: House) -> None:
        for kind in ("application/json", FORM, "text/plain", ""):
            answer = await house.ask(request("/hop/who", b"{}", *lines, kind=kind))
            assert (answer.status, house.ran) == (403, 0)
        assert (await house.ask(request("/hop/who", b"{}", "Origin: http://house", "Sec-Fetch-Site: same-origin"))).status == 200

    visit(test, tmp_path)


def test_h20_the_page_takes_no_script_from_elsewhere_and_no_frame(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(request("/hop/", b"", method="GET", kind="", token=""))
        policy = answer.headers["content-security-policy"]
        assert answer.status == 200 and "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
        assert "unsafe" not in policy and b"<script>" not in answer.body and b"http" not in answer.body.replace(b"http-equiv", b"")

    visit(test, tmp_path)


def test_a_caller_s_words_never_become_log_lines_of_their_own(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    async def test(house: House) -> None:
        caplog.set_level("INFO")
        await house.ask(request("/hop/echo", b'{"value": 1, "a\\nERROR all is lost": 2}'))
        assert caplog.records and not any("\n" in record.getMessage() for record in caplog.records)

    visit(test, tmp_path)


def test_errors_of_each_kind_arrive_as_themselves(tmp_path: Path) -> None:
    kinds: list[tuple[type[HopError], int]] = [(Refused, 403), (Unreachable, 503), (Invalid, 400)]

    @service
    def fail(request: Request, number: int) -> None:
        raise kinds[number][0]("cannot do it: ask again")

    async def test(house: House) -> None:
        for number, (leaf, status) in enumerate(kinds):
            with pytest.raises(leaf) as caught:
                await house.client.call("fail", {"number": number})
            assert caught.value.status == status

    visit(test, tmp_path, fail)
