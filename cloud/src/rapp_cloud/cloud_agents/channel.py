"""a_rep's end of the channel to a cloud agent's runner: JSON objects, one per line, over a UNIX socket pair, in the loop."""

import asyncio
import contextlib
import socket
from typing import Any

from rapp_hop import strict_json
from rapp_hop.errors import Invalid, Unreachable

LONGEST = 64 * 1024  # bytes of one line


class Channel:
    """Reads are for one task."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer

    @classmethod
    async def of(cls, end: socket.socket) -> "Channel":
        """Take one end of a socket pair."""
        return cls(*await asyncio.open_unix_connection(sock=end, limit=LONGEST))

    def send(self, **message: Any) -> None:
        """Send one message; it is short, so nobody waits for it to go.

        :raises Unreachable: the other end is gone
        """
        if self._writer.is_closing():
            raise Unreachable("cannot tell the cloud agent: it has ended")
        self._writer.write(strict_json.dumps(message).encode() + b"\n")

    async def receive(self) -> dict[str, Any] | None:
        """Wait for the next message; None at the end of the channel.

        :raises Invalid: what came is no message
        """
        try:
            line = await self._reader.readline()
        except ValueError:
            raise Invalid(f"it sent a line of more than {LONGEST} bytes") from None
        except OSError:
            return None
        if not line:
            return None
        message = strict_json.loads(line, limit=LONGEST)
        if not isinstance(message, dict) or not isinstance(message.get("type"), str):
            raise Invalid("it sent a message without a type")
        return message

    async def close(self) -> None:
        """Close this end."""
        self._writer.close()
        with contextlib.suppress(OSError):  # the other end may be gone already
            await self._writer.wait_closed()
