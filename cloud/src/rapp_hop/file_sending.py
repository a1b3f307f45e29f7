"""Files onto a connection: by the kernel (sendfile) where it is plain, in pieces where it is encrypted.

What lies in the system's memory is taken on the loop; what would wait for the disk is read in a thread.
"""

import asyncio
import errno
import os
import socket
from collections.abc import Callable

from tornado.iostream import BaseIOStream, IOStream, SSLIOStream, StreamClosedError

from rapp_hop.protocol import OpenFile

PIECE = 256 * 1024  # bytes
_WINDOW = 16 * 2**20  # bytes that are looked for in memory at once
_AT_ONCE = 2**20  # bytes that one connection may take before others have their turn
_GONE = {errno.EPIPE, errno.ECONNRESET, errno.ECONNABORTED, errno.ENOTCONN, errno.ESHUTDOWN, errno.ETIMEDOUT}  # the peer has
_UNABLE = {errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP}  # this file system knows no sendfile


class TooShortError(Exception):
    """A file became shorter while it was sent."""


class _UnableError(Exception):
    """The kernel does not send this file; none of it has gone."""


async def send_file(stream: BaseIOStream, part: OpenFile, patience: float) -> None:
    """Send a part of a file on a connection to which all before has gone.

    :param patience: seconds in which the peer may take nothing
    :raises StreamClosedError: when the peer has gone
    :raises TimeoutError: out of patience
    :raises TooShortError: when not all of it could be sent
    :raises OSError: when it cannot be read
    """
    if isinstance(stream, SSLIOStream) or not isinstance(stream, IOStream):
        await _in_pieces(stream, part, patience)
        return
    try:
        await _by_the_kernel(stream, part, patience)
    except _UnableError:
        await _in_pieces(stream, part, patience)


async def _in_pieces(stream: BaseIOStream, part: OpenFile, patience: float) -> None:
    start, end = part.start, part.start + part.length
    while start < end:
        piece = await _read(part, start, min(end - start, PIECE))
        if not piece:
            raise TooShortError
        start += len(piece)
        written = stream.write(piece)
        if not written.done():
            async with asyncio.timeout(patience):
                await written


async def _by_the_kernel(stream: IOStream, part: OpenFile, patience: float) -> None:
    start, end = part.start, part.start + part.length
    while start < end:
        count = min(end - start, _WINDOW)
        await _brought(part, start, count)
        if stream.closed():
            raise StreamClosedError
        async with asyncio.timeout(patience) as silence:
            pump = _Pump(stream.socket, part, start, start + count)
            pump.on_progress = lambda: silence.reschedule(asyncio.get_running_loop().time() + patience)
            await pump.done()
        start += count


class _Pump:
    """Moves bytes from a file into a socket whenever it takes some."""

    on_progress: Callable[[], None]

    def __init__(self, line: socket.socket, part: OpenFile, start: int, end: int) -> None:
        # A descriptor of our own: Tornado waits on the stream's, and may close it meanwhile.
        self._line = os.dup(line.fileno())
        self._file = part.file.fileno()
        self._start, self._end = start, end
        self._untouched = start == part.start
        self._loop = asyncio.get_running_loop()
        self._done: asyncio.Future[None] = self._loop.create_future()

    async def done(self) -> None:
        """Wait until all of it has gone. Raises as `send_file`."""
        try:
            self._move()
            if not self._done.done():
                self._loop.add_writer(self._line, self._move)
            await self._done
        finally:
            self._loop.remove_writer(self._line)
            os.close(self._line)

    def _move(self) -> None:
        if self._done.done():
            return
        try:
            count = os.sendfile(self._line, self._file, self._start, min(self._end - self._start, _AT_ONCE))
        except BlockingIOError:
            return
        except OSError as error:
            self._done.set_exception(self._meaning(error))
            return
        self._start += count
        self._untouched = False
        self.on_progress()
        if not count:
            self._done.set_exception(TooShortError())
        elif self._start == self._end:
            self._done.set_result(None)

    def _meaning(self, error: OSError) -> Exception:
        if error.errno in _GONE:
            return StreamClosedError(error)
        return _UnableError() if error.errno in _UNABLE and self._untouched else error


async def _brought(part: OpenFile, start: int, count: int) -> None:
    """Have a part of a file in memory, as far as its ends tell, so that sending it does not hold up the loop."""
    file = part.file.fileno()
    try:
        for place in (start, start + count - 1):
            os.preadv(file, [bytearray(1)], place, os.RWF_NOWAIT)
    except BlockingIOError:
        await asyncio.to_thread(os.pread, file, count, start)
    except OSError:
        return  # this file system cannot tell


async def _read(part: OpenFile, start: int, count: int) -> bytes | memoryview:
    piece = bytearray(count)
    try:
        got = os.preadv(part.file.fileno(), [piece], start, os.RWF_NOWAIT)
    except OSError:  # it would have to wait, or this file system cannot tell
        return await asyncio.to_thread(os.pread, part.file.fileno(), count, start)
    return memoryview(piece)[:got]
