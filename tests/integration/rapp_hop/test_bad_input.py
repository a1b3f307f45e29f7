"""Bad input, each item of the project's list of hostile inputs by its number (H; W concerns rosbridge).

Each case gets its status and message, reaches no service, and harms no other request: another caller is served meanwhile and
afterwards, and the neighbour before it on the same connection has its answer.
"""

import asyncio
import json
import socket
import time
from pathlib import Path
from typing import Any

import pytest

from fakes.hop_house import FORM, OTHER, TOKEN, Answer, House, read_answers, request, visit
from rapp_hop.client import HopClient
from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_hop.results import Stream
from rapp_hop.server import ServerLimits
from rapp_hop.service import Request, service

MULTIPART = "multipart/form-data; boundary=B"
PART = b'--B\r\nContent-Disposition: form-data; name="json"\r\n\r\n{}\r\n'


async def refused(house: House, status: int, *pieces: bytes) -> Answer:
    """Send pieces, alone and behind a good neighbour; the same error must come, and nothing run but the neighbour."""
    alone = read_answers(await house.send(*pieces))
    before = house.ran
    good = request(body=b'{"value": "neighbour"}', keep=True)
    both = read_answers(await house.send(good + pieces[0], *pieces[1:]))
    assert [answer.status for answer in alone] == [status]
    assert [answer.status for answer in both] == [200, status]
    assert (both[0].json, house.ran) == ("neighbour", before + 1)
    for answer in (alone[0], both[1]):
        assert answer.headers["connection"] == "close"
        assert answer.json["error"]["kind"] in ("refused", "invalid", "unreachable")
        assert answer.json["error"]["message"].startswith("cannot ")
    assert await house.alive()
    return alone[0]


def bad(tmp_path: Path, status: int, *pieces: bytes, limits: ServerLimits | None = None) -> None:
    async def test(house: House) -> None:
        await refused(house, status, *pieces)

    visit(test, tmp_path, limits=limits)


def test_h01_body_over_limit(tmp_path: Path) -> None:
    bad(tmp_path, 413, request(body=b"x" * (2**20 + 1)))


def test_h01_body_over_limit_announced_only(tmp_path: Path) -> None:
    bad(tmp_path, 413, request(body=b"").replace(b"Content-Length: 0", b"Content-Length: 9999999999999"))


def test_h01_body_over_limit_in_chunks(tmp_path: Path) -> None:
    start = request(body=b"").replace(b"Content-Length: 0", b"Transfer-Encoding: chunked")
    bad(tmp_path, 413, start, *[b"10000\r\n" + bytes(65536) + b"\r\n"] * 17)


SLOW = ServerLimits(header_timeout=0.3, body_timeout=0.3)


def test_h02_slow_headers(tmp_path: Path) -> None:
    bad(tmp_path, 408, b"POST /hop/echo HTTP/1.1\r\nHost: x\r\nX-Slow: ", limits=SLOW)


def test_h02_many_slow_connections_keep_nobody_out(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        lines = [socket.create_connection(("127.0.0.1", house.port), 10) for _ in range(100)]
        for line in lines:
            line.sendall(b"POST /hop/echo HTTP/1.1\r\nX: ")
        for _ in range(20):
            assert await house.alive()
        for line in lines:
            line.settimeout(20)
            assert (await asyncio.to_thread(line.recv, 100)).startswith(b"HTTP/1.1 408 ")
            line.close()

    visit(test, tmp_path, limits=SLOW)


def test_h03_slow_body(tmp_path: Path) -> None:
    bad(tmp_path, 408, request(body=b'{"value": 1}')[:-3], limits=SLOW)


def test_h04_ten_thousand_headers(tmp_path: Path) -> None:
    bad(tmp_path, 431, request("/hop/echo", b"{}", *(f"X-{number}: y" for number in range(10_000))))


def test_h04_a_hundred_and_fifty_short_headers(tmp_path: Path) -> None:
    bad(tmp_path, 431, request("/hop/echo", b"{}", *(f"X-{number}: y" for number in range(150))))


def test_h04_a_header_of_64_kb(tmp_path: Path) -> None:
    bad(tmp_path, 431, request("/hop/echo", b"{}", "X: " + "y" * 65536))


CHUNKED = b"Transfer-Encoding: chunked"


@pytest.mark.parametrize(
    "framing",
    [
        b"Content-Length: +5",
        b"Content-Length: 0_5",
        b"Content-Length: 0x5",
        b"Content-Length: -5",
        b"Content-Length: 5 5",
        b"Content-Length:",
        b"Content-Length: 5\r\nContent-Length: 6",
        b"Content-Length: 5\r\nContent-Length: 5",
        b"Content-Length: 5, 5",
        b"Content-Length: 5\r\n" + CHUNKED,
        CHUNKED + b"\r\nContent-Length: 5",
        CHUNKED + b"\r\n" + CHUNKED,
        CHUNKED + b", chunked",
        b"Transfer-Encoding: gzip, chunked",
        b"Transfer-Encoding: xchunked",
        b"Transfer-Encoding: identity",
    ],
)
def test_h05_framing_that_can_be_read_in_two_ways(tmp_path: Path, framing: bytes) -> None:
    smuggled = b"0\r\n\r\n" + request(body=b'{"value": "smuggled"}')
    bad(tmp_path, 400, request(body=b"", keep=True).replace(b"Content-Length: 0", framing) + smuggled)


@pytest.mark.parametrize("size", [b"+5", b"0x5", b"5 ", b"-1", b"g", b"", b"5" * 60])
def test_h05_wrong_chunk_sizes(tmp_path: Path, size: bytes) -> None:
    start = request(body=b"", keep=True).replace(b"Content-Length: 0", CHUNKED)
    bad(tmp_path, 400, start + size + b"\r\nhello\r\n0\r\n\r\n")


@pytest.mark.parametrize("line", ["X: a\rb", "X: a\0b", "X\r: a", "X y: a", "X: a\r\nno colon", ": a", "Host: other"])
def test_h06_bare_line_ends_and_other_rubbish_in_headers(tmp_path: Path, line: str) -> None:
    bad(tmp_path, 400, request("/hop/echo", b"{}", line))


@pytest.mark.parametrize(
    "first",
    [b"rubbish", b"POST", b"POST /hop/echo", b"POST /hop/echo HTTP/2.0", b"POST /hop/echo HTTP/x", b"POST hop/echo HTTP/1.1",
     b"POST http://elsewhere/hop/echo HTTP/1.1", b"POST /hop/\xff HTTP/1.1", b"POST /hop/a b HTTP/1.1"],
)  # fmt: skip
def test_h06_first_lines_that_are_none(tmp_path: Path, first: bytes) -> None:
    bad(tmp_path, 400, request(body=b"{}").replace(b"POST /hop/echo HTTP/1.1", first))


def test_h06_no_host(tmp_path: Path) -> None:
    bad(tmp_path, 400, request(body=b"{}").replace(b"Host: house\r\n", b""))


def many_parts(count: int) -> bytes:
    return PART * count + b"--B--\r\n"


async def invalid(house: House, body: bytes, kind: str, *lines: str, status: int = 400) -> Answer:
    answer = await house.ask(request("/hop/measure", body, "Accept: application/json", *lines, kind=kind))
    assert answer.status == status, answer
    assert answer.json["error"]["message"].startswith("cannot ")
    assert house.ran == 0
    return answer


@pytest.mark.parametrize(
    "body",
    [
        many_parts(10_000),
        b"--B\r\nX: " + b"y" * 10_000 + b"\r\n\r\n\r\n--B--\r\n",
        PART,
        b"--B--\r\n--B--\r\n",
        b"",
        b"\0" * 1000,
        b'--B\r\nContent-Disposition: form-data; name="file"; filename="x"; name="y"\r\n\r\n\r\n--B--\r\n',
        b'--B\r\nContent-Disposition: form-data; name="other"; filename="x"\r\n\r\n\r\n--B--\r\n',
    ],
)
def test_h07_multipart_of_too_many_or_wrong_parts(tmp_path: Path, body: bytes) -> None:
    async def test(house: House) -> None:
        await invalid(house, body, MULTIPART)
        assert not (house.folder / "uploads").exists() or not list((house.folder / "uploads").iterdir())

    visit(test, tmp_path)


def test_h08_a_flood_of_malformed_multipart_is_no_flood_of_the_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    async def test(house: House) -> None:
        caplog.set_level("INFO")
        began = time.monotonic()
        data = request("/hop/measure", b"--B\r\n", "Accept: application/json", kind=MULTIPART, keep=True)
        answers = read_answers(await house.send(data * 300 + request()))
        assert [answer.status for answer in answers] == [400] * 300 + [200]
        lines = [record for record in caplog.records if record.name.startswith("rapp_hop")]
        assert len(lines) <= 5 * (time.monotonic() - began + 2)  # five for each second that it took
        assert len(lines) + house.server.brake.held_back == 300
        assert house.ran == 1

    visit(test, tmp_path, limits=ServerLimits(log_lines=5))


def test_h09_cookies_are_not_read(tmp_path: Path) -> None:
    async def test(house: House) -> None:
        cookie = 'Cookie: a="' + "\\\\" * 7000 + '"'
        assert (await house.ask(request("/hop/echo", b'{"value": 1}', cookie))).status == 200

    visit(test, tmp_path)


@pytest.mark.parametrize(
    "path",
    ["/hop/../echo", "/hop/%2e%2e/echo", "/hop/%252e%252e/x", "/hop/echo%00", "/hop//echo", "/hop/-/../page.js", "/hop/-/%2e%2e/x",
     "/hop/-/page.js%00", "/hop/-/", "/etc/passwd", "//etc/passwd", "/hop/ECHO", "/hop/echo/more", "/hop/__class__"],
)  # fmt: skip
def test_h10_paths_lead_nowhere_else(tmp_path: Path, path: str) -> None:
    async def test(house: House) -> None:
        for method in ("POST", "GET"):
            answer = await house.ask(request(path, b"{}" if method == "POST" else b"", method=method, kind="application/json"))
            assert (answer.status, answer.json["error"]["kind"]) == (404, "refused")
        assert house.ran == 0

    visit(test, tmp_path)


@pytest.mark.parametrize(
    ("status", "method", "kind"),
    [
        (405, "DELETE", "application/json"),
        (405, "PATCH", "application/json"),
        (405, "OPTIONS", ""),
        (400, "POST", "text/plain"),
        (400, "POST", "application/xml"),
        (400, "POST", "application/json; charset=utf-16"),
        (400, "POST", "application/json; charset"),
        (400, "POST", "multipart/mixed; boundary=B"),
    ],
)
def test_h11_wrong_method_type_or_charset(tmp_path: Path, status: int, method: str, kind: str) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(request("/hop/echo", b'{"value": 1}', method=method, kind=kind))
        assert (answer.status, answer.json["error"]["message"][:7]) == (status, "cannot ")
        assert house.ran == 0

    visit(test, tmp_path)


BODIES = [
    b"\xff\xfe",
    b'{"value": "\\ud800"}',
    b'{"value": 1e400}',
    b'{"value": NaN}',
    b'{"value": Infinity}',
    b'{"value": ' + b"9" * 1_000_000 + b"}",
    b"[" * 100_000 + b"]" * 100_000,
    b'{"value":' * 50_000 + b"1" + b"}" * 50_000,
    b'{"value": 1, "value": 2}',
    b'{"value": {"a": 1, "a": 2}}',
    b"[]",
    b"null",
    b'"value"',
    b"{",
    b'{"value": 1}{"value": 2}',
    b"",
    b'{"value": 1, "more": 2}',
    b'{"Value": 1}',
]


@pytest.mark.parametrize("body", BODIES)
def test_h12_json_that_breaks_a_rule(tmp_path: Path, body: bytes) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(request("/hop/echo", body))
        assert (answer.status, answer.json["error"]["kind"]) == (400, "invalid")
        assert len(answer.body) < 1000  # no echo of what was sent
        assert house.ran == 0 and await house.alive()

    visit(test, tmp_path)


@pytest.mark.parametrize(
    "arguments", [{"a": "1"}, {"a": True}, {"a": 1.5}, {"a": None}, {"a": [1]}, {"b": 1}, {"a": 1, "c": 1}, {}]
)
def test_h12_wrong_missing_and_extra_arguments(tmp_path: Path, arguments: dict[str, Any]) -> None:
    async def test(house: House) -> None:
        answer = await house.ask(request("/hop/add", json.dumps(arguments).encode()))
        assert (answer.status, answer.json["error"]["kind"], house.ran) == (400, "invalid", 0)

    visit(test, tmp_path)


def test_h12_a_number_too_large_for_a_float(tmp_path: Path) -> None:
    @service
    def half(value: float) -> float:
        raise AssertionError("must not run")

    async def test(house: House) -> None:
        assert (await house.ask(request("/hop/half", b'{"value": 1' + b"0" * 400 + b"}"))).status == 400

    visit(test, tmp_path, half)


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
