"""How much one run may send through its gate. Pure: time comes in as a number."""

import struct
from collections.abc import Callable

from rapp_core.errors import Invalid

HEADER = 64 << 10  # bytes of a TCPROS connection header
REQUEST = 16 << 20  # bytes of a service request or a goal; the largest is a file to keep
XML = 64 << 10  # bytes of one XMLRPC request or answer
CONNECTIONS = 64  # to services and topics, at once
CONNECTION_RATE = 100.0  # new ones in a second
MESSAGE_RATE = 500.0  # service requests and goals in a second
QUESTIONS = 32  # XMLRPC connections at once
QUESTION_RATE = 200.0  # XMLRPC calls in a second
BURST = 1.0  # s worth of each rate that may come at once
_LENGTH = struct.Struct("<I")


class Pace:
    """A rate that is kept by waiting: who is too fast is not refused, but slowed."""

    def __init__(self, rate: float, now: Callable[[], float]) -> None:
        """`rate` in 1/s, `now` in s."""
        self._rate, self._now = rate, now
        self._free = now() - BURST  # when all that was taken is paid for

    def take(self, count: int = 1) -> float:
        """Take `count`; gives the s to wait before any more is taken."""
        now = self._now()
        self._free = max(self._free, now - BURST) + count / self._rate
        return max(0.0, self._free - now)


class Frames:
    """Where messages begin and end in a stream of TCPROS: each has its length in front."""

    def __init__(self, limit: int) -> None:
        """`limit`: bytes of one message."""
        self._limit = limit
        self._left = 0  # bytes of the present message still to come
        self._head = b""  # of a length that is cut

    def feed(self, data: bytes) -> int:
        """Pass over the next bytes; gives how many messages begin in them. Raises Invalid."""
        position, begun, end = 0, 0, len(data)
        while position < end:
            if self._left:
                step = min(self._left, end - position)
                self._left -= step
                position += step
                continue
            piece = data[position : position + 4 - len(self._head)]
            self._head += piece
            position += len(piece)
            if len(self._head) == 4:
                (self._left,) = _LENGTH.unpack(self._head)
                self._head = b""
                begun += 1
                if self._left > self._limit:
                    raise Invalid(f"cannot take a message of {self._left} bytes; {self._limit} is the limit")
        return begun


def encode_header(fields: dict[str, str]) -> bytes:
    """A TCPROS connection header with its length in front (wiki.ros.org/ROS/Connection Header)."""
    lines = [f"{name}={value}".encode() for name, value in fields.items()]
    body = b"".join(_LENGTH.pack(len(line)) + line for line in lines)
    return _LENGTH.pack(len(body)) + body


def header_in(data: bytes) -> tuple[dict[str, str], bytes] | None:
    """The connection header at the beginning of a stream and what comes after it; None when it is cut. Raises Invalid."""
    if len(data) < 4:
        return None
    (size,) = _LENGTH.unpack_from(data)
    if size > HEADER:
        raise Invalid(f"cannot take a connection header of {size} bytes; {HEADER} is the limit")
    if len(data) < 4 + size:
        return None
    body, fields = data[4 : 4 + size], {}
    while body:
        length = _LENGTH.unpack_from(body)[0] if len(body) >= 4 else size
        if length > len(body) - 4:
            raise Invalid("cannot read a connection header whose lengths do not add up")
        name, _, value = body[4 : 4 + length].decode(errors="replace").partition("=")
        fields[name] = value
        body = body[4 + length :]
    return fields, data[4 + size :]
