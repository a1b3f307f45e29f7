"""One HTTP/1.1 connection of the server: httptools parses, jobs answer, one after another, in the order of the requests.

Hop's native clients close their sending half right after the request; a request that is whole is answered all the same.
What breaks HTTP's rules is answered with its status and ends the connection, after the answers that come before it.
"""

import asyncio
from collections import deque
from typing import Protocol, cast

import httptools

from rapp_hop.errors import HopError, Invalid, Refused, Unreachable
from rapp_hop.heading import long_head, make_head
from rapp_hop.heads import Exchange, Head, Job
from rapp_hop.protocol import WireAnswer
from rapp_hop.sending import Sender
from rapp_hop.spool import Spool

LINGER = 1.0  # seconds to read on after the last answer, so that the peer can read it


class Site(Protocol):
    """What a connection needs of its server."""

    header_bytes: int
    header_timeout: float  # seconds
    body_timeout: float  # seconds
    idle_timeout: float  # seconds
    send_timeout: float  # seconds in which a peer takes nothing of an answer

    def opened(self, connection: "Connection") -> HopError | None:
        """Know a new connection; an error turns it away."""

    def closed(self, connection: "Connection") -> None:
        """Forget a connection."""

    def begin(self, head: Head) -> Job | WireAnswer:
        """Return who answers a request, or the answer."""

    def spool(self) -> Spool:
        """Return a place for a body."""

    def malformed(self, error: HopError) -> WireAnswer:
        """Return the answer for what is no request."""


class Connection(asyncio.Protocol):
    """See the module."""

    def __init__(self, site: Site, loop: asyncio.AbstractEventLoop) -> None:
        self.address = ""
        self.deadline: float | None = None
        self._site = site
        self._loop = loop
        self._parser = httptools.HttpRequestParser(self)
        self._waiting: deque[Exchange] = deque()
        self._coming: Exchange | None = None  # its body is not whole
        self._task: asyncio.Task[None] | None = None
        self._head_bytes = 0
        self._url = b""
        self._fields: list[tuple[bytes, bytes]] = []
        self._in_head = False
        self._deaf = False  # the last request has come
        self._eof = False
        self._lingering = False
        self._paused = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to serve."""
        self._transport = cast(asyncio.Transport, transport)  # uvloop's is none by inheritance
        self._sender = Sender(self._transport, self._loop)
        peer = transport.get_extra_info("peername")
        self.address = peer[0] if isinstance(peer, tuple) and peer else ""
        self._idle()
        turned_away = self._site.opened(self)
        if turned_away is not None:
            self._end_with(turned_away)
            self._serve_next()

    def connection_lost(self, exc: Exception | None) -> None:
        """Know that nobody is there any more; a call that runs goes on, its answer goes nowhere."""
        self._sender.lost()
        self._deaf = True
        self.deadline = None
        for exchange in [*self._waiting, *([self._coming] if self._coming else [])]:
            self._drop(exchange)
        self._waiting.clear()
        self._coming = None
        self._site.closed(self)

    def data_received(self, data: bytes) -> None:
        """Parse, then serve what is whole."""
        if self._deaf:
            return
        was_in_head = self._in_head
        try:
            self._parser.feed_data(data)
        except httptools.HttpParserUpgrade:
            self._end_with(Invalid("cannot change the protocol of this connection: send no Upgrade"))
        except httptools.HttpParserError as error:
            if not self._deaf:
                self._end_with(Invalid(f"cannot read the request: {str(error)[:100] or 'it is no HTTP'}"))
        if was_in_head and self._in_head and not self._deaf:
            self._head_bytes += len(data)
            if self._head_bytes > self._site.header_bytes:
                self._end_with(long_head(self._site.header_bytes))
        if self._coming is not None and self._coming.answer is not None and not self._deaf:
            self._answer_early(self._coming)
        self._serve_next()
        self._hold_back()

    def eof_received(self) -> bool:
        """Keep the other half open while there is something to answer."""
        self._eof = True
        return not self._lingering and self.busy

    def pause_writing(self) -> None:
        """See asyncio."""
        self._sender.pause()

    def resume_writing(self) -> None:
        """See asyncio."""
        self._sender.resume()

    def on_message_begin(self) -> None:
        """A request begins."""
        self._url, self._fields = b"", []
        self._in_head, self._head_bytes = True, 0
        self.deadline = self._loop.time() + self._site.header_timeout

    def on_url(self, url: bytes) -> None:
        """Its target, or a piece of it."""
        self._url += url

    def on_header(self, name: bytes, value: bytes) -> None:
        """One header line; those after a body are not taken."""
        if self._coming is None and not self._deaf:
            self._fields.append((name, value))

    def on_headers_complete(self) -> None:
        """Know who answers, and whether the body may come."""
        self._in_head = False
        version = self._parser.get_http_version()
        exchange = Exchange(None, self._parser.should_keep_alive() and version == "1.1", version)
        self._coming = exchange
        if self._deaf:
            return
        try:
            method = self._parser.get_method().decode("ascii")
            exchange.head = make_head(method, version, self._url, self._fields, self.address, self._site.header_bytes)
            found = self._site.begin(exchange.head)
        except HopError as error:
            exchange.keep = False
            exchange.answer = self._site.malformed(error)
            return
        if isinstance(found, WireAnswer):
            exchange.answer = found
            return
        exchange.job = found
        self._announced(exchange, found)

    def on_body(self, piece: bytes) -> None:
        """A piece of the body."""
        exchange = self._coming
        if exchange is None or exchange.answer is not None or exchange.job is None or self._deaf:
            return
        if exchange.body is None:
            exchange.body = self._site.spool()
        exchange.body.add(piece)
        if exchange.body.length > exchange.job.max_body:
            self._too_large(exchange, exchange.job)

    def on_message_complete(self) -> None:
        """The request is whole."""
        exchange, self._coming = self._coming, None
        if exchange is not None and not self._deaf:
            self._waiting.append(exchange)
            self._deaf = not exchange.keep
            self.deadline = None

    def overdue(self) -> None:
        """End what the peer lets wait for too long."""
        if self._lingering or not self._sender.free:
            self._transport.abort()
        elif self._in_head or self._coming is not None:
            what = "headers" if self._in_head else "body"
            self._end_with(Unreachable(f"cannot wait any longer for the {what} of the request", 408))
            self._serve_next()
        else:
            self._transport.close()

    @property
    def busy(self) -> bool:
        """Whether it answers a request just now."""
        return self._task is not None or bool(self._waiting)

    def close(self) -> None:
        """End at once."""
        if self._task is not None:
            self._task.cancel()
        self._transport.abort()

    def _announced(self, exchange: Exchange, job: Job) -> None:
        assert exchange.head is not None
        headers = exchange.head.headers
        length = headers.get("content-length", "0")
        if int(length) > job.max_body:
            self._too_large(exchange, job)
        elif length != "0" or "transfer-encoding" in headers:
            self.deadline = self._loop.time() + self._site.body_timeout
            if headers.get("expect", "").lower() == "100-continue" and not self.busy:
                self._transport.write(b"HTTP/1.1 100 Continue\r\n\r\n")

    def _too_large(self, exchange: Exchange, job: Job) -> None:
        exchange.answer = job.failed(Refused(f"cannot take more than {job.max_body} bytes for this request", 413))
        exchange.keep = False
        if exchange.body is not None:
            exchange.body.drop()

    def _answer_early(self, exchange: Exchange) -> None:
        """Answer before the body has come; the rest of the connection is not listened to."""
        exchange.keep = False
        self._coming = None
        self._waiting.append(exchange)
        self._deaf = True
        self.deadline = None

    def _end_with(self, error: HopError) -> None:
        if self._coming is not None:
            self._drop(self._coming)
        last = Exchange(None, False, "1.1")
        last.answer = self._site.malformed(error)
        self._answer_early(last)
        self._in_head = False

    def _hold_back(self) -> None:
        """Read no more while requests wait, or while a body goes to the disk."""
        spool = self._coming.body if self._coming is not None else None
        writing = spool.overflow() if spool is not None else None
        if writing is not None:
            writing.add_done_callback(lambda _: self._read_on() if not self._waiting else None)
        if (writing is not None or self._waiting) and not self._paused and not self._eof:
            self._paused = True
            self._transport.pause_reading()

    def _read_on(self) -> None:
        if self._paused and not self._transport.is_closing():
            self._paused = False
            self._transport.resume_reading()

    def _serve_next(self) -> None:
        if self._task is None and self._waiting and not self._transport.is_closing():
            self._task = self._loop.create_task(self._serve(self._waiting.popleft()))

    async def _serve(self, exchange: Exchange) -> None:
        try:
            answer = exchange.answer
            if answer is None and exchange.job is not None:
                body = await exchange.body.whole() if exchange.body is not None else b""
                answer = await exchange.job.run(body)
            if answer is not None:
                without_body = exchange.head is not None and exchange.head.method == "HEAD"
                keep = exchange.keep and not self._eof
                await self._send(answer, keep, without_body, exchange.version)
        finally:
            self._drop(exchange)
            if exchange.job is not None:
                await exchange.job.done()
            self._task = None
        self._after(exchange)

    async def _send(self, answer: WireAnswer, keep: bool, without_body: bool, version: str) -> None:
        def waiting(begins: bool) -> None:
            self.deadline = self._loop.time() + self._site.send_timeout if begins else None

        await self._sender.send(answer, keep, without_body, version, waiting)

    def _after(self, exchange: Exchange) -> None:
        if self._transport.is_closing():
            return
        if self._waiting:
            self._serve_next()
        elif self._eof:
            self._transport.close()
        elif not exchange.keep:
            self._linger()
        else:
            self._idle()
            if self._in_head or self._coming is not None:
                self.deadline = self._loop.time() + self._site.body_timeout
            self._read_on()

    def _linger(self) -> None:
        self._lingering = True
        self.deadline = self._loop.time() + LINGER
        self._transport.write_eof()
        self._read_on()

    def _idle(self) -> None:
        self.deadline = self._loop.time() + self._site.idle_timeout

    def _drop(self, exchange: Exchange) -> None:
        if exchange.body is not None:
            exchange.body.drop()
