import random
import struct

import pytest

from rapp_bridge.errors import Invalid
from rapp_bridge.tcpros import HEADER_LIMIT, SCRATCH, HeaderReader, Splitter, decode_header, encode_header


def test_a_header_goes_there_and_back() -> None:
    fields = {"service": "/say", "md5sum": "*", "message": "a=b\nc=ä"}
    frame = encode_header(fields)
    assert struct.unpack_from("<I", frame) == (len(frame) - 4,)
    assert decode_header(frame[4:]) == fields


@pytest.mark.parametrize("body", [b"\x01", b"\x01\x01", b"\x01\x01\x01", b"\x05\0\0\0a=b"])
def test_a_cut_header_is_noticed(body: bytes) -> None:
    with pytest.raises(Invalid, match="cut"):
        decode_header(body)


def test_a_header_is_read_byte_by_byte_and_what_follows_is_left() -> None:
    reader, frame = HeaderReader(), encode_header({"topic": "/x"}) + b"rest"
    found = [reader.feed(frame[n : n + 1]) for n in range(len(frame) - 4)]
    assert found[:-1] == [None] * (len(found) - 1)
    assert found[-1] == ({"topic": "/x"}, b"")
    assert HeaderReader().feed(frame) == ({"topic": "/x"}, b"rest")


def test_a_header_that_is_no_header_is_refused() -> None:
    with pytest.raises(Invalid, match="no TCPROS"):
        HeaderReader().feed(struct.pack("<I", HEADER_LIMIT + 1))


@pytest.mark.parametrize("most", [1, 5, 4000, SCRATCH * 2])
@pytest.mark.parametrize("has_status", [False, True])
def test_messages_come_out_as_they_were_sent_however_they_are_cut(most: int, has_status: bool) -> None:
    sizes = [0, 1, 100, 30_000] if most < 100 else [0, 1, 100, SCRATCH // 2 - 5, SCRATCH - 4, SCRATCH * 3, 7, SCRATCH // 2 + 1]
    messages = [bytes((number + 1,)) * size for number, size in enumerate(sizes)]
    status = [bytes((number % 2,)) if has_status else b"" for number in range(len(messages))]
    stream = b"".join(s + struct.pack("<I", len(m)) + m for s, m in zip(status, messages, strict=True))
    chance, splitter, received, position = random.Random(2), Splitter(1 << 24, has_status=has_status), [], 0
    while position < len(stream):
        size = chance.randint(1, most)
        received += [bytes(raw) for raw in splitter.feed(stream[position : position + size])]
        position += size
    assert received == [s + m for s, m in zip(status, messages, strict=True)]


def test_a_message_over_the_limit_is_refused_before_it_has_come() -> None:
    with pytest.raises(Invalid, match="100 is the limit"):
        Splitter(100).feed(struct.pack("<I", 101))
