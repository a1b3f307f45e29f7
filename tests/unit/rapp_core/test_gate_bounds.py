"""Bounds of what a RApp may send through its gate."""

import random
import struct

import pytest

from fakes.clock import Clock
from rapp_core.errors import Invalid
from rapp_core.gate.bounds import HEADER, Frames, Pace, encode_header, header_in
from rapp_core.gate.inside import answer_in, check_plain
from rapp_core.gate.questions import read_call


def message(size: int) -> bytes:
    return struct.pack("<I", size) + bytes(size)


# connection headers


def test_a_header_is_read_as_it_was_written():
    fields = {"service": "/rapp_say", "md5sum": "*", "text": "a=b\n"}
    assert header_in(encode_header(fields) + b"rest") == (fields, b"rest")


def test_a_header_that_is_cut_is_waited_for():
    whole = encode_header({"topic": "/x", "callerid": "/y"})
    assert all(header_in(whole[:end]) is None for end in range(len(whole)))


@pytest.mark.parametrize(
    "data",
    [
        struct.pack("<I", HEADER + 1),
        struct.pack("<I", 0xFFFFFFFF),
        b"GET / HTTP/1.1\r\n\r\n",
        struct.pack("<II", 8, 100) + b"abcd",
        struct.pack("<I", 2) + b"ab",
    ],
)
def test_what_is_no_header_is_invalid(data):
    with pytest.raises(Invalid):
        header_in(data)


def test_bytes_that_are_no_text_do_no_harm():
    body = struct.pack("<I", 4) + b"\xff\xfe=\xff"
    assert header_in(struct.pack("<I", len(body)) + body) is not None


# lengths of messages


@pytest.mark.parametrize("seed", range(5))
def test_messages_are_counted_however_they_are_cut(seed):
    chance = random.Random(seed)
    sizes = [chance.choice([0, 1, 3, 4, 5, 1000]) for _ in range(200)]
    data, frames, begun = b"".join(map(message, sizes)), Frames(1000), 0
    while data:
        cut = chance.randrange(1, 700)
        begun += frames.feed(data[:cut])
        data = data[cut:]
    assert begun == len(sizes)


def test_a_message_that_is_too_long_is_seen_by_its_length():
    frames = Frames(1000)
    frames.feed(message(1000))
    assert frames.feed(struct.pack("<I", 1001)[:3]) == 0
    with pytest.raises(Invalid, match="1000 is the limit"):
        frames.feed(struct.pack("<I", 1001)[3:])


# rates


def test_a_pace_lets_a_burst_through_and_then_slows():
    clock = Clock()
    pace = Pace(100.0, clock.now)
    assert max(pace.take() for _ in range(100)) == pytest.approx(0.0)
    assert pace.take() == pytest.approx(0.01)
    clock.advance(0.5)
    assert pace.take() == 0.0


def test_waiting_as_told_keeps_the_rate():
    clock = Clock()
    pace = Pace(50.0, clock.now)
    for _ in range(1000):
        clock.advance(pace.take())
    assert clock.now() == pytest.approx(1000 / 50 - 1, abs=0.1)


# XMLRPC


BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'
    b"<methodCall><methodName>&b;</methodName></methodCall>"
)


@pytest.mark.parametrize("body", [BOMB, BOMB.decode().encode("utf-16"), b"", b"<", b"<methodCall>", b"\xff" * 100, b"<a/>"])
def test_a_request_that_is_no_xmlrpc_is_invalid(body):
    with pytest.raises(Invalid):
        read_call(body)


def test_a_call_is_read():
    body = b"<methodCall><methodName>getPid</methodName><params><param><value>/me</value></param></params></methodCall>"
    assert read_call(body) == ("getPid", ["/me"])


@pytest.mark.parametrize("text", [b"", b"HTTP/1.1 500 x\r\n\r\n", b"HTTP/1.1 200 OK\r\n\r\n" + BOMB, b"HTTP/1.1 200 OK\r\n\r\n<x>"])
def test_an_answer_that_is_no_xmlrpc_is_invalid(text):
    with pytest.raises(Invalid):
        answer_in(text)


def test_plain_xml_passes():
    check_plain(b"<?xml version='1.0'?><methodResponse/>")
