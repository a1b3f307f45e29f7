"""A WebSocket client for load: it counts frames, and looks into them only when asked to."""

import asyncio
import json
import time
from collections.abc import Callable
from typing import Any

from fakes.bridge_wire import framed, request

PATIENCE = 30.0  # s until something counts as missing


class Client(asyncio.Protocol):
    """One connection; its frames are masked with zeros, to leave the processor to the server."""

    def __init__(self) -> None:
        self.opened: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.closed = asyncio.Event()
        self.on_message: Callable[[bytes], object] | None = None
        self.reset()
        self._rest = b""
        self._skip = 0  # bytes of a large frame that are still to come
        self._read: Callable[[bytes], object] = self._shake_hands

    def reset(self) -> None:
        """Count from zero."""
        self.count, self.last = 0, 0.0

    def connection_made(self, transport: Any) -> None:
        self.transport = transport
        transport.write(request({}))

    def connection_lost(self, _error: Exception | None) -> None:
        self.closed.set()

    def data_received(self, data: bytes) -> None:
        self._read(data)

    def send(self, **fields: Any) -> None:
        """A JSON message."""
        self.transport.write(framed(json.dumps(fields).encode()))

    async def receive(self, op: str) -> dict[str, Any]:
        """The next message of this kind."""
        found: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()

        def look(data: bytes) -> None:
            if not found.done() and (message := json.loads(data))["op"] == op:
                found.set_result(message)

        self.on_message = look
        try:
            return await asyncio.wait_for(found, PATIENCE)
        finally:
            self.on_message = None

    async def settle(self) -> None:
        """Wait until all that was sent has been served."""
        self.send(op="settle")
        await self.receive("status")

    async def counted(self, number: int) -> None:
        """Wait until so many frames have come, or no more come."""
        before = -1
        while before < self.count < number:
            before = self.count
            for _ in range(20):
                await asyncio.sleep(0.05)
                if self.count >= number:
                    return

    def close(self) -> None:
        self.transport.abort()

    def _shake_hands(self, data: bytes) -> None:
        head, end, rest = (self._rest + data).partition(b"\r\n\r\n")
        if not end:
            self._rest = head
        elif head.startswith(b"HTTP/1.1 101 "):
            self._rest, self._read = b"", self._frames
            self.opened.set_result(None)
            self._frames(rest)

    def _frames(self, data: bytes) -> None:
        self.last = time.monotonic()
        position = self._skip
        if position > len(data):
            self._skip -= len(data)
            return
        self.count += position > 0
        self._skip = 0
        if self._rest:
            data, position = self._rest + data, 0
        while (found := _bounds(data, position)) is not None:
            start, stop = found
            if stop > len(data):
                if self.on_message is None:
                    self._skip, position = stop - len(data), len(data)
                break
            if self.on_message is not None:
                self.on_message(data[start:stop])
            self.count += 1
            position = stop
        self._rest = data[position:]


def _bounds(data: bytes, position: int) -> tuple[int, int] | None:
    """Where a frame's payload begins and ends."""
    if len(data) - position < 2:
        return None
    size, start = data[position + 1], position + 2
    if size >= 126:
        start += 2 if size == 126 else 8
        if len(data) < start:
            return None
        size = int.from_bytes(data[position + 2 : start], "big")
    return start, start + size


async def connect(port: int) -> Client:
    """A client after its handshake."""
    loop = asyncio.get_running_loop()
    _, client = await loop.create_connection(Client, "127.0.0.1", port)
    await asyncio.wait_for(client.opened, PATIENCE)
    return client
