"""A request's body while it comes: a little in memory, what is longer in a file of its own."""

import asyncio
import contextlib
import tempfile
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import IO

from rapp_hop.errors import HopError
from rapp_hop.protocol import Body, turned_away

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
            self._problem = turned_away("cannot take this request now: the server holds too many long ones, try again later")
        if self._problem is not None:
            self.drop()
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

        :raises Unreachable: when there was no room for it, or the disk took it not
        """
        if self._writing is not None:
            await self._writing
        found: Body = bytes(self._buffer)
        if self._problem is None and self._file is not None:
            found = await asyncio.to_thread(self._mapped, self._file)
        if self._problem is not None:
            self.drop()
            raise self._problem
        return found

    def drop(self) -> None:
        """Let go of all."""
        self._room.left += self._held
        self._held = 0
        self._buffer = bytearray()
        if self._file is not None and (self._writing is None or self._writing.done()):
            with contextlib.suppress(OSError):  # of what it could not write before
                self._file.close()

    def _write(self, data: bytearray) -> None:
        try:
            if self._file is None:
                self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
                self._file = tempfile.TemporaryFile(dir=self._folder)  # noqa: SIM115 (closed by drop)
            self._file.write(data)
        except OSError as error:
            self._problem = bad_disk(error)

    def _mapped(self, file: IO[bytes]) -> Body:
        try:
            file.write(self._buffer)
            file.flush()
            return mmap(file.fileno(), 0, access=ACCESS_READ)
        except OSError as error:
            self._problem = bad_disk(error)
            return b""


def bad_disk(error: OSError) -> HopError:
    """Return the error of a call whose body or files the disk does not take; it was not begun."""
    return turned_away(f"cannot keep this request: {error.strerror}, see the platform's disk and try again later")
