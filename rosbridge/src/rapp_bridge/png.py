"""The png encoding of rosbridge: a JSON text as the pixels of an RGB picture, the picture as base64 in a JSON text."""

import math
import struct

import numpy as np
import pybase64
from isal import isal_zlib

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_EFFORT = 1  # of 0 to 3; base64 text of a picture shrinks little at any


def png_message(text: bytes) -> bytes:
    """The message that carries another message's JSON as a picture."""
    return b'{"op":"png","data":"' + pybase64.b64encode(png(text)) + b'"}'


def png(text: bytes) -> bytes:
    """A picture whose pixels are the text, filled up with newlines; nearly square, as upstream's."""
    width = max(1, math.isqrt(len(text) // 3))
    height = max(1, math.ceil(len(text) / 3 / width))
    rows = np.full((height, 1 + 3 * width), ord("\n"), np.uint8)
    rows[:, 0] = 0  # filter none
    full, rest = divmod(len(text), 3 * width)
    given = np.frombuffer(text, np.uint8)
    rows[:full, 1:] = given[: full * 3 * width].reshape(full, 3 * width)
    if rest:
        rows[full, 1 : 1 + rest] = given[full * 3 * width :]
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = isal_zlib.compress(rows, _EFFORT)
    return _SIGNATURE + _chunk(b"IHDR", head) + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", isal_zlib.crc32(data, isal_zlib.crc32(kind)))
