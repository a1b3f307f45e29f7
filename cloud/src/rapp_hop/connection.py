"""One request on a connection of Tornado's HTTP server: its head is judged, its body kept, a job answers it.

A `tornado.httputil.HTTPMessageDelegate` without Tornado's handlers. An error that is known before the body has come waits a
moment for the body, so that a request behind it on the same connection is served; then it is answered and ends the connection.
"""

import asyncio
import logging
from typing import Protocol

from tornado.httputil import HTTPConnection, HTTPHeaders, HTTPMessageDelegate, RequestStartLine, ResponseStartLine

from rapp_hop.errors import HopError, Refused, Unreachable
from rapp_hop.heading import make_head
from rapp_hop.heads import Head, Job
from rapp_hop.protocol import OpenFile, WireAnswer
from rapp_hop.sending import send
from rapp_hop.spool import Spool
from rapp_hop.streams import PatientStream, PatientTlsStream

_log = logging.getLogger(__name__)
GRACE = 0.25  # seconds for a body that is not wanted
LINGER = 10.0  # seconds for what still comes of it when it has been answered
LINGER_BYTES = 64 * 2**20


class Site(Protocol):
    """What a request needs of its server."""

    header_bytes: int
    body_timeout: float  # seconds
    send_timeout: float  # seconds in which a peer takes nothing of an answer

    def begin(self, head: Head) -> Job | WireAnswer:
        """Return who answers a request, or the answer."""

    def running(self, message: "Message", is_so: bool) -> None:
        """Know which requests are being answered."""

    def spool(self) -> Spool:
        """Return a place for a body."""

    def malformed(self, error: HopError) -> WireAnswer:
        """Return the answer for what is no request."""


class Message(HTTPMessageDelegate):
    """See the module."""

    def __init__(self, site: Site, line: HTTPConnection, stream: PatientStream | PatientTlsStream, address: str) -> None:
        self.stream = stream
        self.deadline: float | None = None  # of the body
        self._site = site
        self._line = line
        self._address = address
        self._loop = asyncio.get_running_loop()
        self._head: Head | None = None
        self._job: Job | None = None
        self._answer: WireAnswer | None = None
        self._body: Spool | None = None
        self._keep = False
        self._version = "1.1"
        self._task: asyncio.Task[None] | None = None
        self._whole = False
        self._unwanted = 0  # bytes of the body that were dropped
        self._over: asyncio.Event | None = None  # nothing more is to be waited for
        stream.expect(self._loop.time())

    def headers_received(
        self, start_line: RequestStartLine | ResponseStartLine, headers: HTTPHeaders
    ) -> "asyncio.Task[None] | None":
        """Know who answers, and whether the body may come; who asks first is told before he sends it."""
        assert isinstance(start_line, RequestStartLine)
        self.stream.expecting = False
        if self.stream.closed():  # what follows a request that ended the connection, still in Tornado's hands
            return None
        self._version = start_line.version.removeprefix("HTTP/")
        try:
            head = make_head(start_line.method, self._version, start_line.path, headers, self._address, self._site.header_bytes)
        except HopError as error:
            self._answer = self._site.malformed(error)
            self._answer_now()
            return self._task
        self._head = head
        connection = head.headers.get("connection", "").lower()
        self._keep = connection != "close" if self._version == "1.1" else connection == "keep-alive"
        found = self._site.begin(head)
        if isinstance(found, WireAnswer):
            self._answer = found
        else:
            self._job = found
        self._expect_body(head)
        return self._task if "expect" in head.headers else None

    def data_received(self, chunk: bytes) -> "asyncio.Future[None] | None":
        """Keep a piece of the body; nothing more is read while it goes to the disk."""
        if self._answer is not None or self._job is None:
            self._unwanted += len(chunk)
            if self._unwanted > LINGER_BYTES:
                self._end_lingering()
            return None
        if self._body is None:
            self._body = self._site.spool()
        self._body.add(chunk)
        if self._body.length > self._job.max_body:
            self._too_large(self._job)
            return None
        return self._body.overflow()

    def finish(self) -> None:
        """The request is whole."""
        self._whole = True
        self.deadline = None
        self._end_lingering()
        if self._task is None:
            self._task = self._loop.create_task(self._serve())
            self._site.running(self, True)

    def on_connection_close(self) -> None:
        """The peer has gone, or broken the rules, before the request was whole."""
        self._end_lingering()
        if self._task is None:
            self._end()

    def overdue(self) -> None:
        """The body does not come: answer without it."""
        if self._answer is None and self._job is not None:
            self._answer = self._job.failed(Unreachable("cannot wait any longer for the body of the request", 408))
        self._answer_now()

    def cancel(self) -> None:
        """End the call that runs."""
        if self._task is not None:
            self._task.cancel()

    def _expect_body(self, head: Head) -> None:
        length = head.headers.get("content-length", "0")
        if length == "0" and "transfer-encoding" not in head.headers:
            return
        if self._job is not None and length.isdecimal() and int(length) > self._job.max_body:
            self._too_large(self._job)
            return
        if self._answer is not None and "expect" in head.headers:
            self._answer_now()
            return
        self.deadline = self._loop.time() + (GRACE if self._answer is not None else self._site.body_timeout)

    def _too_large(self, job: Job) -> None:
        self._answer = job.failed(Refused(f"cannot take more than {job.max_body} bytes for this request", 413))
        self._answer_now()

    def _answer_now(self) -> None:
        """Answer although the body has not come; that ends the connection."""
        self._keep = False
        self.deadline = None
        if self._task is None:
            self._task = self._loop.create_task(self._serve())
            self._site.running(self, True)

    async def _serve(self) -> None:
        answer = self._answer
        try:
            if answer is None and self._job is not None:
                answer = await self._answer_of(self._job)
            if answer is not None and not self.stream.closed():
                without_body = self._head is not None and self._head.method == "HEAD"
                await send(self.stream, answer, self._keep, without_body, self._version, self._site.send_timeout)
                if not self._whole:
                    await self._linger()
                self._line.finish()
                if not self._keep:
                    self.stream.close()
        except Exception:  # noqa: BLE001 (nobody waits for this task)
            _log.exception("an answer could not be sent")
            self.stream.close()
        finally:
            self._end()
            if answer is not None and isinstance(answer.body, OpenFile):
                answer.body.file.close()
            if self._job is not None:
                await self._job.done()
            self._site.running(self, False)

    async def _linger(self) -> None:
        """Drop what still comes, for a while: closed at once, the connection is reset, and the answer with it."""
        if self._head is None or "expect" in self._head.headers or self.stream.closed():
            return
        self._end()
        self._over = asyncio.Event()
        self.stream.finish_writing()
        try:
            async with asyncio.timeout(LINGER):
                await self._over.wait()
        except TimeoutError:
            pass

    def _end_lingering(self) -> None:
        if self._over is not None:
            self._over.set()

    async def _answer_of(self, job: Job) -> WireAnswer:
        try:
            body = await self._body.whole() if self._body is not None else b""
        except HopError as error:
            return job.failed(error)
        return await job.run(body)

    def _end(self) -> None:
        if self._body is not None:
            self._body.drop()
        self.deadline = None
