"""Where a download's bytes go: counted, bounded, and stopped when nobody wants them any more."""

from collections.abc import Callable

from rapp_hop.errors import HopError, Invalid

REFUSAL = 64 * 1024  # bytes
PARTIAL = 206  # HTTP status of a part that was asked for (RFC 9110 section 14)
Writer = Callable[[bytes], object]
Progress = Callable[[int, int | None], None]  # bytes so far, bytes announced (None: not announced)


class Sink:
    """Receives one response's header lines and pieces; `check()` afterwards tells what went wrong."""

    def __init__(self, url: str, write: Writer, limit: int, on_progress: Progress | None, start: int = 0) -> None:
        """Take the writer; it gets what comes after the first `start` bytes of the whole."""
        self.received = 0  # bytes of the whole
        self.refusal = b""  # the beginning of the body of an answer that is none
        self.on_piece: Callable[[], object] = lambda: None
        self._url = url
        self._write = write
        self._limit = limit
        self._on_progress = on_progress
        self._announced: int | None = None
        self._status = 0
        self._start = self._skip = start
        self._wrong: HopError | OSError | None = None
        self._stopped = False

    def header(self, line: str) -> None:
        """Take one header line of the response (the status line first)."""
        if line.startswith("HTTP/"):
            words = line.split()
            self._status = int(words[1]) if len(words) > 1 and words[1].isdecimal() else 0
        name, _, value = (part.strip().lower() for part in line.partition(":"))
        if name == "content-range" and self._status == PARTIAL and value.startswith(f"bytes {self._start}-"):
            self.received, self._skip = self._start, 0
        if name == "content-length" and value.isdecimal():
            self._announced = int(value) + (self._start if self._status == PARTIAL else 0)
            if self._announced > self._limit and self._status in (200, PARTIAL):
                self._too_long()

    def data(self, piece: bytes) -> None:
        """Take one piece of the body.

        What is not wanted is dropped in silence: the client's own bound on size and time ends the transfer.
        """
        wanted = self._status == 200 or (self._status == PARTIAL and self._start > 0)
        if not wanted and len(self.refusal) < REFUSAL:
            self.refusal += piece
        if not wanted or self._wrong is not None or self._stopped:
            return
        self.on_piece()
        if self._status == PARTIAL and self._skip:
            self._wrong = Invalid(f"cannot accept {self._url}: it is another part than was asked for")
            return
        self.received += len(piece)
        if self.received > self._limit:
            self._too_long()
            return
        known, piece = piece[: self._skip], piece[self._skip :]  # a server without ranges begins anew
        self._skip -= len(known)
        try:
            self._write(piece)
        except OSError as error:
            self._wrong = error
            return
        if self._on_progress is not None:
            self._on_progress(self.received, self._announced)

    def stop(self) -> None:
        """Want no more: nothing is written from now on."""
        self._stopped = True

    def check(self) -> None:
        """Raise what ended the transfer early on this side, if anything did.

        :raises Invalid: more bytes than allowed
        :raises OSError: the writer's own error, such as a full disk
        """
        if self._wrong is not None:
            raise self._wrong

    def _too_long(self) -> None:
        self._wrong = Invalid(f"cannot accept {self._url}: it is longer than {self._limit} bytes")
