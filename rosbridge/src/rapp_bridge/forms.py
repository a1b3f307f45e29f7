"""The two encodings of a message's fields, JSON and CBOR, in pieces: a large array is never copied into the text around it."""

import secrets
import struct
from collections.abc import Callable
from typing import Any

import cbor2
import numpy as np
import orjson
import pybase64

from rapp_bridge.arrays import LITTLE_ENDIAN_TAGS
from rapp_bridge.decoding import Form, Raw
from rapp_bridge.rostypes import CODES

Piece = bytes | bytearray | memoryview

APART = 1 << 15  # bytes of an array from which it is kept apart from the text
_MARK = secrets.token_bytes(16).hex().encode()  # stands in the text for an array that is apart; nobody outside can know it
_QUOTED = b'"' + _MARK + b'"'
_MARK_BYTES = _MARK[:16]
_TAGGED = b"\x50" + _MARK_BYTES  # as CBOR, a string of 16 bytes


class _Apart:
    """A large array of a message, to be put between the pieces of the text."""

    def __init__(self, payload: memoryview) -> None:
        self.payload = payload


def _json_octets(raw: Raw, start: int, size: int) -> Any:
    part = memoryview(raw)[start : start + size]
    return _Apart(part) if size >= APART else pybase64.b64encode_as_string(part)


def _json_numbers(kind: str) -> Callable[[Raw, int, int], Any]:
    dtype = np.dtype("<" + CODES[kind])
    return lambda raw, start, count: np.frombuffer(raw, dtype, count, start)


def _cbor_octets(raw: Raw, start: int, size: int) -> Any:
    return _Apart(memoryview(raw)[start : start + size]) if size >= APART else bytes(raw[start : start + size])


def _cbor_numbers(kind: str) -> Callable[[Raw, int, int], Any]:
    if kind not in LITTLE_ENDIAN_TAGS:
        raise ValueError(kind)
    tag, width = LITTLE_ENDIAN_TAGS[kind], np.dtype(CODES[kind]).itemsize

    def numbers(raw: Raw, start: int, count: int) -> Any:
        return cbor2.CBORTag(tag, _cbor_octets(raw, start, count * width))

    return numbers


JSON = Form("json", _json_octets, _json_numbers)
"""Bytes as base64 text, numbers as numpy arrays, which orjson writes: NaN and infinities as null."""

CBOR = Form("cbor", _cbor_octets, _cbor_numbers)
"""Bytes as bytes, numbers as typed arrays (RFC 8746), little-endian."""


def json_pieces(value: Any) -> list[Piece]:
    """The JSON of decoded fields."""
    apart: list[memoryview] = []

    def fill(array: Any) -> str:
        apart.append(array.payload)
        return _MARK.decode()

    text = orjson.dumps(value, default=fill, option=orjson.OPT_SERIALIZE_NUMPY)
    if not apart:
        return [text]
    first, *others = text.split(_QUOTED)
    pieces: list[Piece] = [first]
    for payload, part in zip(apart, others, strict=True):
        pieces[-1] = bytes(pieces[-1]) + b'"'
        pieces += [pybase64.b64encode(payload), b'"' + part]
    return pieces


def cbor_pieces(value: Any) -> list[Piece]:
    """The CBOR of decoded fields."""
    apart: list[memoryview] = []

    def fill(encoder: Any, array: Any) -> None:
        apart.append(array.payload)
        encoder.encode(_MARK_BYTES)

    data = cbor2.dumps(value, default=fill)
    if not apart:
        return [data]
    first, *others = data.split(_TAGGED)
    pieces: list[Piece] = [first]
    for payload, part in zip(apart, others, strict=True):
        pieces[-1] = bytes(pieces[-1]) + struct.pack(">BI", 0x5A, len(payload))
        pieces += [payload, part]
    return pieces
