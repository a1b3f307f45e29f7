"""A connection to a ROS service, kept for many calls (TCPROS, wiki.ros.org/ROS/TCPROS), on asyncio.

rospy's own ServiceProxy knows no time-out and takes a thread per waiting call; here both come from the event loop.
"""

import asyncio
import io
import struct
from typing import Any

import genpy

from rapp_bridge.conversion import service_class
from rapp_bridge.errors import Invalid, Refused, Unreachable

HEADER_LIMIT = 1 << 20  # bytes


class ServiceConnection:
    """One persistent connection; one call at a time. After an error or a cancelled call it must be closed."""

    def __init__(self, name: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, limit: int) -> None:
        self._name = name
        self._reader = reader
        self._writer = writer
        self._limit = limit
        self.type: Any = None

    @classmethod
    async def open(cls, name: str, address: tuple[str, int], caller: str, limit: int) -> "ServiceConnection":
        """Connect and learn the service's type from it; `limit`: bytes of a response.

        Raises Unreachable, or Invalid when the type is not built here.
        """
        try:
            reader, writer = await asyncio.open_connection(*address)
        except OSError as error:
            raise Unreachable(f"cannot call {name}: {error}; its node is gone") from error
        connection = cls(name, reader, writer, limit)
        try:
            connection.type = await connection._shake_hands(caller)
        finally:
            if connection.type is None:
                connection.close()
        return connection

    @property
    def usable(self) -> bool:
        """Whether the other side still holds the connection, as far as is known."""
        return not self._reader.at_eof() and not self._writer.is_closing()

    def close(self) -> None:
        """Close it; a call in progress on the other side goes on there."""
        self._writer.close()

    async def call(self, request: Any) -> Any:
        """Call with a request message; gives the response message.

        Raises Refused when the service answers with an error, Invalid when the request does not fit its type, Unreachable.
        """
        frame = _serialized(request)
        try:
            self._writer.write(frame)
            await self._writer.drain()
            done, size = struct.unpack("<BI", await self._reader.readexactly(5))
            if size > self._limit:
                raise Refused(f"cannot take the answer of {self._name}: {size} bytes, more than {self._limit}")
            body = await self._reader.readexactly(size)
        except (OSError, asyncio.IncompleteReadError) as error:
            raise Unreachable(f"cannot know what became of the call of {self._name}: its node closed the connection") from error
        if not done:
            raise Refused(f"cannot call {self._name}: it answered with an error: {body.decode(errors='replace')}")
        try:
            return self.type._response_class().deserialize(body)
        except genpy.DeserializationError as error:
            raise Invalid(f"cannot read the answer of {self._name}: {error}") from error

    async def _shake_hands(self, caller: str) -> Any:
        self._writer.write(encode_header({"service": self._name, "md5sum": "*", "callerid": caller, "persistent": "1"}))
        try:
            (size,) = struct.unpack("<I", await self._reader.readexactly(4))
            if size > HEADER_LIMIT:
                raise Unreachable(f"cannot call {self._name}: what listens there speaks no TCPROS")
            fields = decode_header(await self._reader.readexactly(size))
        except (OSError, asyncio.IncompleteReadError, struct.error) as error:
            raise Unreachable(f"cannot call {self._name}: its node closed the connection") from error
        if "type" not in fields:
            raise Unreachable(f"cannot call {self._name}: {fields.get('error', 'its node does not say its type')}")
        found = service_class(fields["type"])
        if fields.get("md5sum", found._md5sum) != found._md5sum:
            raise Invalid(f"cannot call {self._name}: its {fields['type']} is another version than the one built here")
        return found


def _serialized(message: Any) -> bytes:
    buffer = io.BytesIO(b"\0\0\0\0")
    buffer.seek(4)
    try:
        message.serialize(buffer)
    except (genpy.SerializationError, struct.error) as error:
        raise Invalid(f"cannot call with these arguments: {error}") from error
    buffer.seek(0)
    buffer.write(struct.pack("<I", len(buffer.getbuffer()) - 4))
    return buffer.getvalue()


def encode_header(fields: dict[str, str]) -> bytes:
    """A TCPROS connection header with its length in front."""
    lines = [f"{name}={value}".encode() for name, value in fields.items()]
    body = b"".join(struct.pack("<I", len(line)) + line for line in lines)
    return struct.pack("<I", len(body)) + body


def decode_header(body: bytes) -> dict[str, str]:
    """The fields of a TCPROS connection header, given without its length; raises struct.error when it is cut."""
    fields: dict[str, str] = {}
    while body:
        (size,) = struct.unpack_from("<I", body)
        name, _, value = body[4 : 4 + size].decode(errors="replace").partition("=")
        fields[name] = value
        body = body[4 + size :]
    return fields
