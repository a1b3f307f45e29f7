"""rosbridge v2 messages to clients, as frames. No I/O."""

import itertools
from collections.abc import Sequence
from typing import Any

import cbor2
import orjson

from rapp_bridge.decoding import Raw, decode
from rapp_bridge.errors import Invalid
from rapp_bridge.forms import CBOR, JSON, Piece, cbor_pieces, json_pieces
from rapp_bridge.png import png_message
from rapp_bridge.protocol import CallService, Compression, Id, Level
from rapp_bridge.websocket import BINARY, TEXT, Frame, frame

TEXT_LIMIT = 500  # characters of an error's text

_numbers = itertools.count(1)


def publication(
    topic: str, raw: Raw, cls: Any, compression: Compression, fragment_size: int | None, stamp: tuple[int, int]
) -> Frame:
    """A topic's message; `stamp`: when it was received; `cls` may be None for cbor-raw. Raises Invalid."""
    if compression == "cbor-raw":
        return frame(BINARY, _cbor_publication(topic, _raw_pieces(raw, stamp)))
    if cls is None:
        raise Invalid(f"cannot read the messages of {topic}: their type is not known; subscribe with a type")
    if compression == "cbor":
        return frame(BINARY, _cbor_publication(topic, cbor_pieces(decode(raw, cls, CBOR))))
    head = b'{"op":"publish","topic":' + orjson.dumps(topic) + b',"msg":'
    pieces: list[Piece] = [head, *json_pieces(decode(raw, cls, JSON)), b"}"]
    if compression == "png":
        pieces = [png_message(b"".join(pieces))]
    return text_frame(pieces, fragment_size)


def text_frame(pieces: Sequence[Piece], fragment_size: int | None = None) -> Frame:
    """A JSON message's frame, or those of its fragments when it is longer than `fragment_size` characters."""
    if fragment_size is None or sum(map(len, pieces)) <= fragment_size:
        return frame(TEXT, pieces)
    text = b"".join(pieces).decode()
    if len(text) <= fragment_size:
        return frame(TEXT, pieces)
    parts = [text[start : start + fragment_size] for start in range(0, len(text), fragment_size)]
    name = f"fragment:{next(_numbers)}"
    frames: list[Piece] = []
    for number, part in enumerate(parts):
        fields = {"op": "fragment", "id": name, "data": part, "num": number, "total": len(parts)}
        frames += frame(TEXT, [orjson.dumps(fields)])
    return tuple(frames)


def service_result(call: CallService, values: Sequence[Piece]) -> Frame:
    """The answer to a client's call: the JSON of the response's fields."""
    return _result(call, values, b"true")


def service_failure(call: CallService, text: str) -> Frame:
    """The answer to a client's call that failed."""
    return _result(call, [orjson.dumps(cut(text))], b"false")


def _result(call: CallService, values: Sequence[Piece], result: bytes) -> Frame:
    head = b'{"op":"service_response","service":%b,"values":' % orjson.dumps(call.service)
    tail = b',"result":%b' % result + (b"}" if call.id is None else b',"id":%b}' % orjson.dumps(call.id))
    return text_frame([head, *values, tail], call.fragment_size)


def service_request(service: str, request: str, args: Sequence[Piece]) -> Frame:
    """A call for the client that advertised `service`; `request` is the id its answer must carry."""
    head = b'{"op":"call_service","id":%b,"service":%b,"args":' % (orjson.dumps(request), orjson.dumps(service))
    return frame(TEXT, [head, *args, b"}"])


def status(level: Level, text: str, message_id: Id = None) -> Frame:
    """A status (protocol section 3.2.2)."""
    fields: dict[str, Any] = {"op": "status", "level": level, "msg": cut(text)}
    if message_id is not None:
        fields["id"] = message_id
    return frame(TEXT, [orjson.dumps(fields)])


def cut(text: str) -> str:
    """A text at a length that gives no client its own frame back, without what JSON cannot carry."""
    return text[:TEXT_LIMIT].encode(errors="replace").decode()


def _cbor_publication(topic: str, msg: list[Piece]) -> list[Piece]:
    return [b"\xa3\x62op\x67publish\x65topic" + cbor2.dumps(topic) + b"\x63msg", *msg]


def _raw_pieces(raw: Raw, stamp: tuple[int, int]) -> list[Piece]:
    secs, nsecs = (cbor2.dumps(part) for part in stamp)
    head = b"\xa3\x64secs" + secs + b"\x65nsecs" + nsecs + b"\x65bytes\x5a" + len(raw).to_bytes(4, "big")
    return [head, raw]
