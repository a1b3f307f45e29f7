"""RFC 6455 on the server's side."""

import base64
import random
import struct

import pytest

from rapp_bridge.handshake import TurnedAwayError, answer
from rapp_bridge.websocket import (
    BINARY,
    CLOSE,
    PING,
    PROTOCOL_ERROR,
    TEXT,
    TOO_BIG,
    Reader,
    Received,
    ViolationError,
    close_frame,
    unmasked,
)

MASK = b"\x01\x80\xfe\x7f"


def sent(opcode: int, data: bytes, *, final: bool = True, mask: bytes = MASK) -> bytes:
    """A frame as clients send it."""
    first, size = opcode | (0x80 if final else 0), len(data)
    if size < 126:
        head = bytes((first, 0x80 | size))
    elif size < 1 << 16:
        head = struct.pack(">BBH", first, 0xFE, size)
    else:
        head = struct.pack(">BBQ", first, 0xFF, size)
    return head + mask + unmasked(mask, data)


def test_frames_come_out_as_they_were_sent_however_they_are_cut() -> None:
    messages = [(TEXT, b""), (TEXT, b"a"), (PING, b"p"), (BINARY, bytes(range(256)) * 2), (TEXT, b"x" * 70_000), (TEXT, b"end")]
    stream = b"".join(sent(*message) for message in messages)
    chance = random.Random(1)
    for most in (1, 3, 7, 1000, 100_000):
        reader, received, position = Reader(1 << 20), [], 0
        while position < len(stream):
            size = chance.randint(1, most)
            received += reader.feed(stream[position : position + size])
            position += size
        assert received == [Received(*message) for message in messages]


def test_a_message_in_several_frames_with_a_ping_between() -> None:
    stream = sent(TEXT, b"one ", final=False) + sent(0, b"two ", final=False) + sent(PING, b"") + sent(0, b"three")
    assert Reader(100).feed(stream) == [Received(PING, b""), Received(TEXT, b"one two three")]


@pytest.mark.parametrize(
    ("stream", "code"),
    [
        (b"\x81\x01x", PROTOCOL_ERROR),
        (b"\xc1\x81" + MASK + b"x", PROTOCOL_ERROR),
        (sent(3, b""), PROTOCOL_ERROR),
        (sent(11, b""), PROTOCOL_ERROR),
        (sent(0, b"x"), PROTOCOL_ERROR),
        (sent(TEXT, b"x", final=False) + sent(TEXT, b"y"), PROTOCOL_ERROR),
        (sent(PING, b"x" * 126), PROTOCOL_ERROR),
        (sent(CLOSE, b"", final=False), PROTOCOL_ERROR),
        (sent(TEXT, b"x" * 1001), TOO_BIG),
        (b"\x81\xff" + b"\xff" * 8, TOO_BIG),
        (sent(TEXT, b"x" * 900, final=False) + sent(0, b"x" * 900), TOO_BIG),
        (sent(TEXT, b"", final=False) + sent(0, b"", final=False) * 20_000, TOO_BIG),
    ],
)
def test_violations_end_the_connection_with_a_code(stream: bytes, code: int) -> None:
    with pytest.raises(ViolationError) as caught:
        Reader(1000).feed(stream)
    assert caught.value.code == code


def test_a_close_frame_is_short_and_whole() -> None:
    (data,) = close_frame(1008, "ä" * 100)
    assert len(data) <= 127
    assert data[4:].decode() == "ä" * 61


KEY = base64.b64encode(b"0123456789abcdef").decode()
GOOD = {"Host": "robot:9090", "Upgrade": "websocket", "Connection": "keep-alive, Upgrade", "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": KEY}  # fmt: skip


def head(*, first: str = "GET /any/path?x=1 HTTP/1.1", **fields: str) -> bytes:
    lines = [first, *(f"{name}: {value}" for name, value in {**GOOD, **fields}.items() if value)]
    return "\r\n".join(lines).encode("latin-1")


def test_the_example_of_the_rfc() -> None:
    accepted = answer(head(**{"Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}), ())
    assert accepted.response.startswith(b"HTTP/1.1 101 ")
    assert b"\r\nSec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n" in accepted.response
    assert accepted.response.endswith(b"\r\n\r\n")
    assert accepted.token is None


def test_a_token_may_come_with_the_request() -> None:
    assert answer(head(Authorization="Bearer abc "), ()).token == "abc"
    assert answer(head(Authorization="Basic abc"), ()).token is None


@pytest.mark.parametrize(
    ("fields", "status"),
    [
        ({"Upgrade": ""}, "426"),
        ({"Connection": "close"}, "426"),
        ({"Sec-WebSocket-Version": "8"}, "400"),
        ({"Sec-WebSocket-Key": "x"}, "400"),
        ({"Sec-WebSocket-Key": ""}, "400"),
        ({"first": "POST / HTTP/1.1"}, "400"),
        ({"first": "GET / HTTP/1.0"}, "400"),
        ({"first": "GET /"}, "400"),
        ({" bad name": "x"}, "400"),
        ({"Origin": "https://evil.example"}, "403"),
        ({"Origin": "null"}, "403"),
        ({"Origin": "http://127.0.0.1.evil.example"}, "403"),
        ({"Origin": "http://robot:8000"}, "403"),
        ({"Origin": "http://[::1"}, "403"),
        ({"Origin": "https://evil.example", "Host": "192.168.1.7"}, "403"),
        ({"Origin": "null", "Host": "192.168.1.7"}, "403"),
        ({"Origin": "http://192.168.1.8", "Host": "192.168.1.7"}, "403"),
    ],
)
def test_requests_that_are_turned_away(fields: dict[str, str], status: str) -> None:
    with pytest.raises(TurnedAwayError) as caught:
        answer(head(**fields), ("https://friend.example",))
    assert caught.value.response.startswith(f"HTTP/1.1 {status} ".encode())
    assert str(caught.value).startswith("cannot ")


@pytest.mark.parametrize("line", ["Host: other", "Origin: http://localhost", "no colon"])
def test_a_request_with_doubtful_lines_is_turned_away(line: str) -> None:
    with pytest.raises(TurnedAwayError):
        answer(head(Origin="http://localhost") + f"\r\n{line}".encode(), ())


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("http://localhost:8000", "robot:9090"),
        ("http://127.0.0.1", "robot:9090"),
        ("https://[::1]:44", "robot:9090"),
        ("https://friend.example", "robot:9090"),
        ("http://192.168.1.7:8000", "192.168.1.7:9090"),
        ("https://192.168.1.7", "192.168.1.7"),
        ("http://[fe80::7]:8000", "[fe80::7]:9090"),
    ],
)
def test_pages_that_are_welcome(origin: str, host: str) -> None:
    assert answer(head(Origin=origin, Host=host), ("https://friend.example",)).response.startswith(b"HTTP/1.1 101 ")


def test_all_pages_are_welcome_when_told_so() -> None:
    assert answer(head(Origin="https://any.example"), ("*",)).response.startswith(b"HTTP/1.1 101 ")
