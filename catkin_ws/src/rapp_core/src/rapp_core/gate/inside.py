"""Sockets of the sandbox's own network, made by the runner before it knew its RApp, and used from outside.

The sandbox has no network but its own loopback. A socket stays in the network in which it was made, so the gate accepts at
listeners made inside, and reaches the RApp's node over unconnected ones.
"""

import asyncio
import contextlib
import socket
import xmlrpc.client
from typing import Any

from rapp_core.errors import Invalid, Refused, Unreachable
from rapp_core.gate.bounds import XML
from rapp_core.gate.upstream import Address

LOOPBACK = "127.0.0.1"
PATIENCE = 3.0  # s for the RApp's node to answer
BATCH = 16  # descriptors in one message


class Inside:
    """The sandbox's sockets; they come over `end` until it is closed."""

    def __init__(self, end: socket.socket) -> None:
        """Wait for nothing; see `arrive`."""
        self._end = end
        self._stock: list[socket.socket] = []
        self._publishers: dict[int, Address] = {}  # of a node's XMLRPC port

    async def arrive(self) -> tuple[socket.socket, socket.socket]:
        """Take all sockets: gives the listeners of ROS master and relay. Raises Unreachable when the runner has gone before."""
        loop, got = asyncio.get_running_loop(), []
        self._end.setblocking(False)
        readable = asyncio.Event()
        loop.add_reader(self._end, readable.set)
        data = b" "
        while data:
            await readable.wait()
            readable.clear()
            data, numbers, _, _ = socket.recv_fds(self._end, 1, BATCH)
            got += [socket.socket(fileno=number) for number in numbers]
        loop.remove_reader(self._end)
        self._end.close()
        for each in got:
            each.setblocking(False)
        if len(got) < 2:
            raise Unreachable("cannot guard the sandbox: its sockets did not come")
        master, relay, *self._stock = got
        return master, relay

    async def publisher(self, topic: str, port: int, node: str) -> tuple[socket.socket, Address]:
        """Where a node inside publishes a topic, and a socket to go there with. Raises CoreError.

        `port`: that of the node's XMLRPC API; asked once for each node.
        """
        if port not in self._publishers:
            answer = await self._ask(port, "requestTopic", node, topic, [["TCPROS"]])
            try:
                self._publishers[port] = (LOOPBACK, int(answer[2][2]))
            except (LookupError, TypeError, ValueError) as error:
                raise Invalid(f"cannot hear {topic}: the RApp's node answers with {answer!r}"[:300]) from error
        return self._take(), self._publishers[port]

    def _take(self) -> socket.socket:
        if not self._stock:
            raise Refused("cannot connect into the sandbox any more: its node was connected to too often in this run")
        return self._stock.pop()

    async def _ask(self, port: int, method: str, *words: Any) -> Any:
        body = xmlrpc.client.dumps(words, method).encode()
        head = f"POST / HTTP/1.0\r\nHost: {LOOPBACK}\r\nContent-Type: text/xml\r\nContent-Length: {len(body)}\r\n\r\n"
        connection = self._take()
        try:
            async with asyncio.timeout(PATIENCE):
                text = await self._exchange(connection, port, head.encode() + body)
            return answer_in(text)
        except (OSError, TimeoutError) as error:
            raise Unreachable(f"cannot reach the RApp's node: {error}") from error
        finally:
            connection.close()

    @staticmethod
    async def _exchange(connection: socket.socket, port: int, request: bytes) -> bytes:
        loop, text = asyncio.get_running_loop(), b""
        await loop.sock_connect(connection, (LOOPBACK, port))
        await loop.sock_sendall(connection, request)
        while piece := await loop.sock_recv(connection, XML):
            text += piece
            if len(text) > XML:
                raise Invalid(f"cannot take an answer of more than {XML} bytes")
        return text


def answer_in(text: bytes) -> Any:
    """The value in an HTTP response that carries an XMLRPC one. Raises Invalid."""
    body = text.partition(b"\r\n\r\n")[2]
    check_plain(body)
    with contextlib.suppress(Exception):  # whatever a hostile answer makes the parser raise
        return xmlrpc.client.loads(body)[0][0]
    raise Invalid("cannot read the answer of the RApp's node: it is no XMLRPC")


def check_plain(body: bytes) -> None:
    """Raise Invalid for XML with declarations, such as of entities, which XMLRPC has no use for."""
    if b"<!" in body or b"\0" in body:
        raise Invalid("cannot read XML with declarations of its own")
