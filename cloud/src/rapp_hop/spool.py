"""A request's body while it comes: a little in memory, what is longer in a file of its own."""

import asyncio
import tempfile
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import IO

from rapp_hop.protocol import Body

IN_MEMORY = 256 * 1024  # bytes


class Spool:
    """Collects one body; `whole()` returns it. Disk work is done in threads."""

    def __init__(self, folder: Path) -> None:
        self.length = 0
        self._folder = folder
        self._buffer = bytearray()
        self._file: IO[bytes] | None = None
        self._writing: asyncio.Future[None] | None = None

    def add(self, piece: bytes) -> None:
        """Take one piece."""
        self.length += len(piece)
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

        :raises OSError: when the disk took it not
        """
        if self._writing is not None:
            await self._writing
        if self._file is None:
            return bytes(self._buffer)
        return await asyncio.to_thread(self._mapped)

    def drop(self) -> None:
        """Let go of all."""
        self._buffer = bytearray()
        if self._file is not None and (self._writing is None or self._writing.done()):
            self._file.close()

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
