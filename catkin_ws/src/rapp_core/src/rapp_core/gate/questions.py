"""XMLRPC as ROS speaks it, served with bounds: size, calls in a second, connections at once."""

import asyncio
import logging
import socket
import time
import xmlrpc.client
from collections.abc import Awaitable, Callable
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPHeaders, HTTPServerRequest, ResponseStartLine
from tornado.iostream import IOStream

from rapp_core.errors import Invalid, Unreachable
from rapp_core.gate.bounds import QUESTION_RATE, QUESTIONS, XML, Pace
from rapp_core.gate.inside import check_plain

HEAD = 8 << 10  # bytes of a request's head
IDLE = 60.0  # s without a request after which a connection is closed
BODY = 5.0  # s for a request to arrive
MANY = 256  # calls in one system.multicall, which rospy says its farewell with
LONGEST = 256  # characters of a name or an address

Outcome = tuple[int, str, Any]
Answerer = Callable[[str, list[Any]], Awaitable[Outcome]]
"""Answers a method called with these words: status, text, value (wiki.ros.org/ROS/Master_Slave_APIs)."""

logging.getLogger("tornado.access").setLevel(logging.ERROR)


class Questions(HTTPServer):
    """Serves one listener."""

    def initialize(self, answerer: Answerer) -> None:  # type: ignore[override]  # tornado's own kind of constructor
        """`answerer` gets each call that is well-formed."""
        super().initialize(self._request, max_header_size=HEAD, max_body_size=XML, body_timeout=BODY, idle_connection_timeout=IDLE)
        self._answerer = answerer
        self._room = asyncio.Semaphore(QUESTIONS)
        self._pace = Pace(QUESTION_RATE, time.monotonic)
        self._tasks: set[asyncio.Task[None]] = set()

    async def serve(self, listener: socket.socket) -> None:
        """Serve until cancelled; who comes while all connections are taken waits."""
        loop = asyncio.get_running_loop()
        while True:
            await self._room.acquire()
            connection, address = await loop.sock_accept(listener)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.handle_stream(IOStream(connection), address)

    def on_close(self, server_conn: object) -> None:
        """See tornado."""
        super().on_close(server_conn)
        self._room.release()

    def _request(self, request: HTTPServerRequest) -> None:
        task = asyncio.get_running_loop().create_task(self._respond(request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _respond(self, request: HTTPServerRequest) -> None:
        code, body = 200, b""
        try:
            method, words = read_call(request.body)
            answer = await self._multicall(words) if method == "system.multicall" else await self._answer(method, words)
            body = xmlrpc.client.dumps((answer,), methodresponse=True, allow_none=True).encode()
        except Invalid as error:
            code, body = 400, str(error).encode()
        except Unreachable as error:
            code, body = 503, str(error).encode()
        headers = HTTPHeaders({"Content-Type": "text/xml", "Content-Length": str(len(body))})
        connection = request.connection
        if connection is not None:
            connection.write_headers(ResponseStartLine("HTTP/1.1", code, ""), headers, body)
            connection.finish()

    async def _multicall(self, words: list[Any]) -> list[Any]:
        calls = words[0] if len(words) == 1 and isinstance(words[0], list) else []
        answers = []
        for call in calls[:MANY]:
            if not isinstance(call, dict) or not isinstance(call.get("params"), list):
                raise Invalid("cannot read the calls in a system.multicall")
            answers.append([await self._answer(str(call.get("methodName")), call["params"])])
        return answers

    async def _answer(self, method: str, words: list[Any]) -> list[Any]:
        await asyncio.sleep(self._pace.take())
        if not all(isinstance(word, list | int | str | bool | float | dict) for word in words) or any(
            isinstance(word, str) and len(word) > LONGEST for word in words
        ):
            return [-1, "cannot take these words: they are too long, or no words", 0]
        return list(await self._answerer(method[:LONGEST], words))


def read_call(body: bytes) -> tuple[str, list[Any]]:
    """Method and words of an XMLRPC request. Raises Invalid."""
    check_plain(body)
    try:
        words, method = xmlrpc.client.loads(body)
    except Exception as error:  # whatever a hostile request makes the parser raise
        raise Invalid(f"cannot read the request: {type(error).__name__}") from error
    if not method:
        raise Invalid("cannot read the request: it names no method")
    return str(method), list(words)
