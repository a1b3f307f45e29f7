"""The server's side of a WebSocket connection after its handshake (RFC 6455), pure: bytes in, messages out."""

import struct
from collections.abc import Iterable
from typing import NamedTuple

from rapp_bridge.forms import Piece

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
_CONTROL_LIMIT = 125  # bytes
_JOINED = 1 << 14  # bytes of a frame up to which its pieces are joined
_WHOLE = (0x80 | TEXT, 0x80 | BINARY)  # first bytes of frames that are whole messages
_UNMASKED = b"\0\0\0\0"

NORMAL, GOING_AWAY, PROTOCOL_ERROR, POLICY, TOO_BIG, FAILED = 1000, 1001, 1002, 1008, 1009, 1011
"""Codes of a close frame."""

Frame = tuple[Piece, ...]
"""The bytes of one frame, or of several, in pieces."""


class Received(NamedTuple):
    """One message, or one control frame."""

    opcode: int
    data: bytes


class ViolationError(Exception):
    """The client breaks the protocol; the connection is to be closed with this code."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


def frame(opcode: int, pieces: Iterable[Piece]) -> Frame:
    """A frame with the pieces as its payload; small ones are joined."""
    parts = tuple(pieces)
    size = sum(map(len, parts))
    if size < 126:
        head = bytes((0x80 | opcode, size))
    elif size < 1 << 16:
        head = struct.pack(">BBH", 0x80 | opcode, 126, size)
    else:
        head = struct.pack(">BBQ", 0x80 | opcode, 127, size)
    return (b"".join((head, *parts)),) if size <= _JOINED else (head, *parts)


def close_frame(code: int, reason: str = "") -> Frame:
    """A close frame with its reason, cut to what fits."""
    text = reason.encode()[: _CONTROL_LIMIT - 2].decode(errors="ignore").encode()
    return frame(CLOSE, [struct.pack(">H", code) + text])


class Reader:
    """Puts a client's frames together; holds at most one message, of at most `limit` bytes, beside what it was fed last."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._waiting = bytearray()  # the beginning of a frame
        self._need = 2  # bytes before it is worth looking again
        self._opcode = 0  # of a message in several frames
        self._parts: list[bytes] = []
        self._size = 0  # bytes of the parts

    def feed(self, data: bytes) -> list[Received]:
        """All messages and control frames that are complete now; raises ViolationError."""
        if self._waiting:
            self._waiting += data
            if len(self._waiting) < self._need:
                return []
            data = bytes(self._waiting)
            self._waiting.clear()
        received: list[Received] = []
        position, end = 0, len(data)
        self._need = 2
        while end - position >= 2:
            start, size = self._head(data, position, end)
            if start < 0 or start + size > end:
                self._need = -start if start < 0 else start + size - position
                break
            body = data[start : start + size]
            mask = data[start - 4 : start]
            self._take(data[position], body if mask == _UNMASKED else unmasked(mask, body), received)
            position = start + size
        self._waiting += data[position:] if position else data
        return received

    def _head(self, data: bytes, position: int, end: int) -> tuple[int, int]:
        """Where a frame's payload begins, and its size; (-bytes, 0) while that many bytes are needed to tell."""
        second = data[position + 1]
        if second < 0x80:
            raise ViolationError(PROTOCOL_ERROR, "cannot read a frame that is not masked")
        size, start = second & 0x7F, position + 6
        if size >= 126:
            wide = size == 127
            start += 8 if wide else 2
            if end < start - 4:
                return position - start, 0
            (size,) = struct.unpack_from(">Q" if wide else ">H", data, position + 2)
        if size > self._limit:
            raise ViolationError(TOO_BIG, f"cannot take a message of {size} bytes; {self._limit} is the limit")
        return (start, size) if end >= start else (position - start, 0)

    def _take(self, first: int, body: bytes, received: list[Received]) -> None:
        opcode = first & 0x0F
        if first in _WHOLE and not self._opcode:
            received.append(Received(opcode, body))
        elif first & 0x70:
            raise ViolationError(PROTOCOL_ERROR, "cannot read a frame with reserved bits set")
        elif opcode >= CLOSE:
            self._take_control(first, opcode, body, received)
        else:
            self._take_part(first, opcode, body, received)

    @staticmethod
    def _take_control(first: int, opcode: int, body: bytes, received: list[Received]) -> None:
        if opcode > PONG or not first & 0x80 or len(body) > _CONTROL_LIMIT:
            raise ViolationError(PROTOCOL_ERROR, "cannot read this control frame")
        received.append(Received(opcode, body))

    def _take_part(self, first: int, opcode: int, body: bytes, received: list[Received]) -> None:
        if opcode not in (0, TEXT, BINARY) or (opcode == 0) != bool(self._opcode):
            raise ViolationError(PROTOCOL_ERROR, "cannot read frames in this order")
        self._opcode = self._opcode or opcode
        self._parts.append(body)
        self._size += len(body)
        if self._size > self._limit or len(self._parts) > 1 << 14:
            raise ViolationError(TOO_BIG, f"cannot take a message of more than {self._limit} bytes")
        if first & 0x80:
            received.append(Received(self._opcode, b"".join(self._parts)))
            self._opcode = self._size = 0
            self._parts.clear()


def unmasked(mask: bytes, body: bytes) -> bytes:
    """The payload a client meant; the same again masks it."""
    size = len(body)
    whole = int.from_bytes(mask * (size // 4) + mask[: size % 4], "little")
    return (int.from_bytes(body, "little") ^ whole).to_bytes(size, "little")
