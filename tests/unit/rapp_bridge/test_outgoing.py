import io
import json
import struct
from typing import Any

import cbor2
import cv2
import numpy as np
import pybase64
import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import String

from rapp_bridge.errors import Invalid
from rapp_bridge.outgoing import TEXT_LIMIT, publication, service_failure, service_request, service_result, status, text_frame
from rapp_bridge.png import png
from rapp_bridge.protocol import CallService, Compression
from rapp_bridge.websocket import Frame, Reader, unmasked


def payloads(frame: Frame) -> list[tuple[int, bytes]]:
    """What a WebSocket client makes of the bytes."""
    data, found = b"".join(frame), []
    while data:
        size, start = data[1], 2
        if size == 126:
            size, start = struct.unpack_from(">H", data, 2)[0], 4
        elif size == 127:
            size, start = struct.unpack_from(">Q", data, 2)[0], 10
        assert data[0] & 0x80
        found.append((data[0] & 0x0F, data[start : start + size]))
        data = data[start + size :]
    return found


def read(frame: Frame) -> Any:
    ((opcode, payload),) = payloads(frame)
    return cbor2.loads(payload) if opcode == 2 else json.loads(payload)


def raw(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def published(message: Any, compression: Compression = "none", fragment_size: int | None = None, cls: Any = ...) -> Frame:
    return publication("/x", raw(message), type(message) if cls is ... else cls, compression, fragment_size, (3, 4))


def test_a_topic_message_in_each_compression() -> None:
    expected = {"op": "publish", "topic": "/x", "msg": {"data": "ä"}}
    assert read(published(String("ä"))) == expected
    assert read(published(String("ä"), "cbor")) == expected
    assert read(published(String("ä"), "cbor-raw")) == {**expected, "msg": {"secs": 3, "nsecs": 4, "bytes": raw(String("ä"))}}
    picture = read(published(String("ä"), "png"))
    assert picture["op"] == "png"
    assert json.loads(pixels(pybase64.b64decode(picture["data"]))) == expected


def test_cbor_raw_needs_no_type_and_the_others_do() -> None:
    assert read(published(String("x"), "cbor-raw", cls=None))["msg"]["bytes"] == raw(String("x"))
    with pytest.raises(Invalid, match="subscribe with a type"):
        published(String("x"), "none", cls=None)


def pixels(picture: bytes) -> bytes:
    """The bytes of a picture's pixels, as another library reads them."""
    image = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return bytes(image[:, :, ::-1].tobytes())


@pytest.mark.parametrize("size", [0, 1, 2, 3, 11, 12, 13, 100, 1000, 99_999])
def test_a_picture_holds_the_text_filled_up_with_newlines(size: int) -> None:
    text = bytes(33 + number % 90 for number in range(size))
    held = pixels(png(text))
    assert held.rstrip(b"\n") == text
    assert len(held) - size < 3 * (len(held) ** 0.5 + 3)


@pytest.mark.parametrize("compression", ["none", "png"])
def test_a_long_message_is_sent_in_fragments_of_characters_with_whole_numbers_and_an_id(compression: Compression) -> None:
    whole = read(published(String("€" * 500), compression))
    if compression == "png":
        whole = json.loads(pixels(pybase64.b64decode(whole["data"])))
    parts = [json.loads(payload) for _, payload in payloads(published(String("€" * 500), compression, 100))]
    assert len(parts) > 1
    assert {part["op"] for part in parts} == {"fragment"}
    assert [part["num"] for part in parts] == list(range(len(parts)))
    assert {part["total"] for part in parts} == {len(parts)}
    assert all(type(part["total"]) is int for part in parts)
    (name,) = {part["id"] for part in parts}
    assert isinstance(name, str)
    assert name
    assert all(len(part["data"]) == 100 for part in parts[:-1])
    joined = json.loads("".join(part["data"] for part in parts))
    assert (json.loads(pixels(pybase64.b64decode(joined["data"]))) if compression == "png" else joined) == whole


def test_two_fragmented_messages_have_different_ids() -> None:
    names = [json.loads(payloads(published(String("x" * 500), "none", 100))[0][1])["id"] for _ in range(2)]
    assert names[0] != names[1]


def test_a_message_that_fits_is_not_fragmented_nor_is_cbor() -> None:
    assert read(published(String("€" * 20), "none", 70))["op"] == "publish"
    assert read(published(String("x" * 500), "cbor", 100))["op"] == "publish"


def test_answers_are_written_with_the_ids_they_were_asked_with() -> None:
    assert read(service_result(CallService("/s", {}, 7), [b'{"a":1}'])) == {
        "op": "service_response", "service": "/s", "values": {"a": 1}, "result": True, "id": 7,
    }  # fmt: skip
    assert "id" not in read(service_failure(CallService("/s", {}), "no"))
    assert read(service_failure(CallService("/s", {}, ""), "no"))["id"] == ""
    assert read(service_request("/s", "r1", [b"{}"])) == {"op": "call_service", "id": "r1", "service": "/s", "args": {}}
    assert read(status("error", "cannot", "i")) == {"op": "status", "level": "error", "msg": "cannot", "id": "i"}


def test_a_response_is_fragmented_when_its_call_wants_it() -> None:
    parts = payloads(service_result(CallService("/s", {}, 7, None, 50), [b'"' + b"x" * 300 + b'"']))
    assert json.loads("".join(json.loads(part)["data"] for _, part in parts))["values"] == "x" * 300


def test_an_error_is_cut_and_made_fit_for_json() -> None:
    assert len(read(status("error", "x" * 10_000_000))["msg"]) == TEXT_LIMIT
    assert read(status("error", "a\udc80"))["msg"] == "a?"


@pytest.mark.parametrize("size", [0, 125, 126, 65535, 65536, 200_000])
def test_frames_of_all_lengths(size: int) -> None:
    pieces = [b"x" * (size // 2), b"y" * (size - size // 2)]
    ((opcode, payload),) = payloads(text_frame(pieces))
    assert (opcode, payload) == (1, b"".join(pieces))


def test_a_large_picture_is_not_copied_into_its_frame() -> None:
    message = Image(data=bytes(1_000_000))
    serial = raw(message)
    frame = publication("/x", serial, Image, "cbor", None, (0, 0))
    assert any(isinstance(piece, memoryview) and piece.obj is serial for piece in frame)


def test_masking_twice_gives_the_same() -> None:
    data = bytes(range(256)) * 3
    assert unmasked(b"abcd", unmasked(b"abcd", data)) == data
    assert Reader(10).feed(b"\x81\x83abcd" + unmasked(b"abcd", b"xyz"))[0].data == b"xyz"
