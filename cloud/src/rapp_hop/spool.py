"""A request's body while it comes: a little in memory, what is longer in a file of its own."""

import asyncio
import tempfile
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import IO

from rapp_hop.errors import HopError, Unreachable
from rapp_hop.protocol import TURNED_AWAY, Body

IN_MEMORY = 256 * 1024  # bytes


class Room:
    """What the bodies of one server may take together, in memory and on the disk."""

    def __init__(self, size: int) -> None:
        """:param size: bytes"""
        self.left = size


class Spool:
    """Collects one body; `whole()` returns it. Disk work is done in threads. What finds no room is taken and dropped."""

    def __init__(self, folder: Path, room: Room) -> None:
        self.length = 0
        self._folder = folder
        self._room = room
        self._held = 0  # bytes of the room
        self._problem: HopError | None = None
        self._buffer = bytearray()
        self._file: IO[bytes] | None = None
        self._writing: asyncio.Future[None] | None = None

    def add(self, piece: bytes) -> None:
        """Take one piece."""
        self.length += len(piece)
        if self._problem is None and len(piece) > self._room.left:
            self._give_up("cannot take this request now: the server holds too many long ones, try again later")
        if self._problem is not None:
            return
        self._room.left -= len(piece)
        self._held += len(piece)
        self._buffer += piece

    def overflow(self) -> asyncio.Future[None] | None:
        """Begin to write to the disk when there is much; until the future is done nothing should be added."""
        if len(self._buffer) < IN_MEMORY:
            return None
        data, self._buffer = self._buffer, bytearray()
        self._writing = asyncio.get_running_loop().run_in_executor(None, self._write, data)
        return self._writing

    async def whole(self) -> Body:
        """Return the body.

        :raises Unreachable: when there was no room for it
        :raises OSError: when the disk took it not
        """
        if self._writing is not None:
            await self._writing
        if self._problem is not None:
            raise self._problem
        if self._file is None:
            return bytes(self._buffer)
        return await asyncio.to_thread(self._mapped)

    def drop(self) -> None:
        """Let go of all."""
        self._room.left += self._held
        self._held = 0
        self._buffer = bytearray()
        if self._file is not None and (self._writing is None or self._writing.done()):
            self._file.close()

    def _give_up(self, why: str) -> None:
        self._problem = Unreachable(why, 503)
        self._problem.reason = TURNED_AWAY
        self.drop()

    def _write(self, data: bytearray) -> None:
        if self._file is None:
            self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._file = tempfile.TemporaryFile(dir=self._folder)  # noqa: SIM115 (closed by drop)
        self._file.write(data)

    def _mapped(self) -> mmap:
        assert self._file is not None
        self._file.write(self._buffer)
        self._file.flush()
        return mmap(self._file.fileno(), 0, access=ACCESS_READ)
