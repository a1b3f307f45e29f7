"""TCPROS (wiki.ros.org/ROS/TCPROS), pure: connection headers, and messages out of a stream of bytes."""

import struct

from rapp_bridge.decoding import Raw
from rapp_bridge.errors import Invalid

HEADER_LIMIT = 1 << 20  # bytes
SCRATCH = 1 << 18  # bytes read at once
_LENGTH = struct.Struct("<I")


def encode_header(fields: dict[str, str]) -> bytes:
    """A connection header with its length in front."""
    lines = [f"{name}={value}".encode() for name, value in fields.items()]
    body = b"".join(_LENGTH.pack(len(line)) + line for line in lines)
    return _LENGTH.pack(len(body)) + body


def decode_header(body: Raw) -> dict[str, str]:
    """The fields of a connection header, given without its length; raises Invalid when it is cut."""
    fields: dict[str, str] = {}
    position = 0
    while position < len(body):
        if position + 4 > len(body):
            raise Invalid("cannot read a connection header that is cut")
        (size,) = _LENGTH.unpack_from(body, position)
        line = bytes(body[position + 4 : position + 4 + size])
        if len(line) < size:
            raise Invalid("cannot read a connection header that is cut")
        name, _, value = line.decode(errors="replace").partition("=")
        fields[name] = value
        position += 4 + size
    return fields


class HeaderReader:
    """A connection header out of the first bytes of a stream."""

    def __init__(self) -> None:
        self._data = b""

    def feed(self, data: bytes) -> tuple[dict[str, str], bytes] | None:
        """The header's fields and what came after it, when it is complete; raises Invalid."""
        self._data += data
        if len(self._data) < 4:
            return None
        (size,) = _LENGTH.unpack_from(self._data)
        if size > HEADER_LIMIT:
            raise Invalid("cannot read a connection header so long: this is no TCPROS")
        if len(self._data) < 4 + size:
            return None
        return decode_header(self._data[4 : 4 + size]), self._data[4 + size :]


class Splitter:
    """Messages with their lengths in front, out of a stream that is read into buffers given by `buffer`.

    A large message is read into its own place, so that it is not copied again. With `has_status`, as for the responses of
    services, one byte stands before each length and comes out as the first byte of the message.
    """

    def __init__(self, limit: int, *, has_status: bool = False) -> None:
        """`limit`: bytes of one message."""
        self.limit = limit
        self._extra = 1 if has_status else 0
        self._scratch = bytearray(SCRATCH)
        self._view = memoryview(self._scratch)
        self._have = 0
        self._large: bytearray | None = None
        self._filled = 0

    def buffer(self) -> memoryview:
        """Where to read the next bytes to."""
        if self._large is not None:
            return memoryview(self._large)[self._filled :]
        return self._view[self._have :]

    def filled(self, count: int) -> list[Raw]:
        """So many bytes were read; gives the messages that are complete. Raises Invalid when one is longer than the limit."""
        if self._large is not None:
            self._filled += count
            if self._filled < len(self._large):
                return []
            large, self._large = self._large, None
            return [large]
        self._have += count
        return self._split()

    def feed(self, data: bytes) -> list[Raw]:
        """As `filled`, for bytes that were read elsewhere."""
        messages: list[Raw] = []
        rest = memoryview(data)
        while rest:
            place = self.buffer()
            count = min(len(place), len(rest))
            place[:count] = rest[:count]
            messages += self.filled(count)
            rest = rest[count:]
        return messages

    def _split(self) -> list[Raw]:
        messages: list[Raw] = []
        scratch, position, end, extra = self._scratch, 0, self._have, self._extra
        while end - position >= 4 + extra:
            (size,) = _LENGTH.unpack_from(scratch, position + extra)
            if size > self.limit:
                raise Invalid(f"cannot take a message of {size} bytes; {self.limit} is the limit")
            start = position + 4 + extra
            if start + size > end:
                if 4 + extra + size > SCRATCH // 2:
                    self._begin_large(position, start, size)
                    return messages
                break
            body = bytes(self._view[start : start + size])
            messages.append(bytes(scratch[position : position + 1]) + body if extra else body)
            position = start + size
        if position:
            scratch[: end - position] = scratch[position:end]
            self._have = end - position
        return messages

    def _begin_large(self, position: int, start: int, size: int) -> None:
        """Read what is left of a large message into a place of its own."""
        extra, have = self._extra, self._have - start
        self._large = bytearray(extra + size)
        self._large[:extra] = self._scratch[position : position + extra]
        self._large[extra : extra + have] = self._view[start : self._have]
        self._filled, self._have = extra + have, 0
