"""A WebSocket client that sends whatever bytes a test wants sent, whole or not, and reads only when told to."""

import asyncio
import json
import socket
import ssl
import struct
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlsplit

from fakes.bridge_neighbours import PATIENCE

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
CUT = 1006
"""The code of a connection that ended without a close frame (RFC 6455, section 7.1.5)."""


class TurnedAwayError(Exception):
    """The handshake was not accepted; the text is the whole response."""


def framed(payload: bytes, opcode: int = TEXT, *, first: int | None = None) -> bytes:
    """A client's frame with a mask of zeros; `first`: the first byte, when it is to be another."""
    head = bytes([0x80 | opcode if first is None else first])
    if len(payload) < 126:
        head += bytes([0x80 | len(payload)])
    elif len(payload) < 1 << 16:
        head += struct.pack(">BH", 0x80 | 126, len(payload))
    else:
        head += struct.pack(">BQ", 0x80 | 127, len(payload))
    return head + bytes(4) + payload


class Wire:
    """One connection."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader = reader
        self.writer = writer

    @classmethod
    async def connect(cls, url: str, tls: ssl.SSLContext | None = None) -> "Wire":
        """A connection on which nothing has been said yet; the system keeps little of what is not read."""
        place = urlsplit(url)
        plain = socket.socket()
        plain.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 14)
        plain.setblocking(False)
        async with asyncio.timeout(PATIENCE):
            await asyncio.get_running_loop().sock_connect(plain, (place.hostname, place.port))
            name = place.hostname if tls else None
            return cls(*await asyncio.open_connection(sock=plain, ssl=tls, server_hostname=name, limit=1 << 16))

    @classmethod
    async def open(cls, url: str, headers: Mapping[str, str] | None = None, tls: ssl.SSLContext | None = None) -> "Wire":
        """A connection after its handshake; raises TurnedAwayError."""
        wire = await cls.connect(url, tls)
        wire.writer.write(request(headers or {}))
        async with asyncio.timeout(PATIENCE):
            head = await wire.reader.readuntil(b"\r\n\r\n")
            if not head.startswith(b"HTTP/1.1 101 "):
                rest = await wire.reader.read()
                wire.leave()
                raise TurnedAwayError((head + rest).decode())
        return wire

    def send(self, **fields: Any) -> None:
        """A JSON message."""
        self.raw(framed(json.dumps(fields).encode()))

    def raw(self, data: bytes) -> None:
        """These bytes."""
        self.writer.write(data)

    async def frame(self) -> tuple[int, bytes] | None:
        """The next frame; None when the connection has ended."""
        async with asyncio.timeout(PATIENCE):
            try:
                first, size = await self.reader.readexactly(2)
                if size >= 126:
                    wide = size == 127
                    (size,) = struct.unpack(">Q" if wide else ">H", await self.reader.readexactly(8 if wide else 2))
                return first & 15, await self.reader.readexactly(size)
            except (asyncio.IncompleteReadError, OSError):
                return None

    async def receive(self, op: str) -> dict[str, Any]:
        """The next JSON message of this kind; others are passed over."""
        while (message := await self.receive_any())["op"] != op:
            pass
        return message

    async def receive_any(self) -> dict[str, Any]:
        """The next JSON message."""
        while (found := await self.frame()) is not None:
            if found[0] == TEXT:
                return dict(json.loads(found[1]))
            assert found[0] != CLOSE, found
        raise AssertionError("the bridge cut the connection")

    async def settle(self) -> None:
        """Wait until the bridge has served all that was sent before: frames are served in order."""
        self.send(op="settle")
        while "settle" not in (await self.receive("status"))["msg"]:
            pass

    async def ending(self) -> tuple[int, str, list[str]]:
        """Read until the end: the close frame's code and reason, and the statuses before it."""
        said: list[str] = []
        while (found := await self.frame()) is not None:
            opcode, payload = found
            if opcode == CLOSE:
                return struct.unpack(">H", payload[:2])[0], payload[2:].decode(), said
            if opcode == TEXT and (message := json.loads(payload))["op"] == "status":
                said.append(message["msg"])
        return CUT, "", said

    def leave(self) -> None:
        """Go without a word."""
        self.writer.transport.abort()


def request(headers: Mapping[str, str]) -> bytes:
    """The request of a WebSocket's handshake."""
    fields = {
        "Host": "127.0.0.1", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", **headers,
    }  # fmt: skip
    return "".join(["GET / HTTP/1.1\r\n", *(f"{name}: {value}\r\n" for name, value in fields.items()), "\r\n"]).encode()
