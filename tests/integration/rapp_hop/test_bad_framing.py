"""Bad input, H01 to H06 of the project's list of hostile inputs: sizes, times, framing and headers of requests.

Each case gets its status and message, reaches no service, and harms no other request.
"""

import asyncio
import socket
from pathlib import Path

import pytest

from fakes.bad_requests import CHUNKED, SLOW, bad
from fakes.hop_house import House, request, visit


def test_h01_body_over_limit(tmp_path: Path) -> None:
    bad(tmp_path, 413, request(body=b"x" * (2**20 + 1)))


def test_h01_body_over_limit_announced_only(tmp_path: Path) -> None:
    bad(tmp_path, 413, request(body=b"").replace(b"Content-Length: 0", b"Content-Length: 9999999999999"))


def test_h01_body_over_limit_in_chunks(tmp_path: Path) -> None:
    start = request(body=b"").replace(b"Content-Length: 0", b"Transfer-Encoding: chunked")
    bad(tmp_path, 413, start, *[b"10000\r\n" + bytes(65536) + b"\r\n"] * 17)


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
