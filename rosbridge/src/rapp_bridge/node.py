"""The bridge as a ROS node: rospy registers it and answers for it; the bytes of topics and services go over the event loop.

rospy has a thread for each connection and wakes one for each message. So its TCPROS server is replaced by one on the event
loop, and its handler of new publishers hands their addresses over. Both seams are functions of rospy's own start-up:
`tcpros_base._tcpros_server` and `TCPROSHandler.create_transport`. What rospy itself subscribes (/clock) stays rospy's.
"""

import asyncio
import logging
from collections.abc import Callable
from typing import Any, Protocol

import rosgraph
import rospy
from rospy.impl import tcpros, tcpros_base, transport

from rapp_bridge.errors import BridgeError
from rapp_bridge.links import Welcome
from rapp_bridge.tcpros import HeaderReader, encode_header

BACKLOG = 128  # callers that may connect at once; rospy's own 5 makes the sixth wait a second
HEADER_TIMEOUT = 10.0  # s

_log = logging.getLogger(__name__)


class Acceptor(Protocol):
    """Who serves a connection that another node has opened."""

    def accept(self, header: dict[str, str], transport: Any) -> Welcome:
        """Say how the connection with this header goes on; raises BridgeError."""


Connect = Callable[[str, str, tuple[str, int]], bool]
"""Told, in a thread of rospy's, of a topic's publisher: its URI and address; says whether the topic is ours."""


class Door:
    """Takes the place of rospy's TCPROS server; other nodes' connections come in here."""

    def __init__(self, topics: Acceptor, services: Acceptor) -> None:
        self.topic_connection_handler = self.service_connection_handler = None  # set by rospy, and not used
        self._topics = topics
        self._services = services
        self._port = 0

    async def open(self) -> None:
        """Listen, on the address that ROS_IP or ROS_HOSTNAME allow."""
        loop = asyncio.get_running_loop()
        address = rosgraph.network.get_bind_address()
        self._server = await loop.create_server(lambda: _Knock(self), address, 0, backlog=BACKLOG)
        self._port = self._server.sockets[0].getsockname()[1]

    def start_server(self) -> None:
        """It has started already."""

    def get_address(self) -> tuple[str, int]:
        """Where other nodes find it."""
        return rosgraph.network.get_host_name(), self._port

    def shutdown(self, _reason: str = "") -> None:
        """rospy's shutdown; `close` does it."""

    def close(self) -> None:
        """Listen no more."""
        self._server.close()

    def accept(self, header: dict[str, str], transport: Any) -> Welcome:
        """Find who serves a connection with this header; raises BridgeError."""
        return (self._topics if "topic" in header else self._services).accept(header, transport)


class _Knock(asyncio.Protocol):
    """A connection until its header is read."""

    def __init__(self, door: Door) -> None:
        self._door = door
        self._header = HeaderReader()

    def connection_made(self, transport: Any) -> None:
        self._transport = transport
        self._timer = asyncio.get_running_loop().call_later(HEADER_TIMEOUT, transport.abort)

    def connection_lost(self, _error: Exception | None) -> None:
        self._timer.cancel()

    def data_received(self, data: bytes) -> None:
        try:
            found = self._header.feed(data)
            if found is None:
                return
            self._timer.cancel()
            welcome = self._door.accept(found[0], self._transport)
        except BridgeError as error:
            _log.info("a node's connection is refused: %s", error)
            self._transport.write(encode_header({"error": str(error)}))
            self._transport.close()
            return
        self._transport.write(encode_header(welcome.header))
        if welcome.protocol is None:
            self._transport.close()
            return
        self._transport.set_protocol(welcome.protocol)
        welcome.begin()
        if found[1]:
            welcome.protocol.data_received(found[1])


class Marker(transport.Transport):  # type: ignore[misc]
    """Stands in rospy's lists for a connection on the event loop, so that rosnode shows it and rospy can end it."""

    transport_type = "TCPROS"

    def __init__(self, direction: str, topic: str, endpoint: str, close: Callable[[], object]) -> None:
        super().__init__(direction, topic)
        self.endpoint_id = endpoint
        self._loop = asyncio.get_running_loop()
        self._end = close

    def get_transport_info(self) -> str:
        """For rosnode info."""
        return f"TCPROS connection with [{self.endpoint_id}]"

    def close(self) -> None:
        """End the connection; called by rospy, or by whoever owns it."""
        if not self.done:
            super().close()
            if not self._loop.is_closed():
                self._loop.call_soon_threadsafe(self._end)


def join(door: Door, connect: Connect) -> None:
    """Join ROS as a node; waits for the master as long as it takes."""
    if not rosgraph.is_master_online():
        _log.warning("waits for the ROS master at %s; start roscore", rosgraph.get_master_uri())
    tcpros_base._tcpros_server = door
    handler = tcpros.get_tcpros_handler()
    original = handler.create_transport

    def create_transport(topic: str, publisher: str, words: list[Any]) -> tuple[int, str, int]:
        if len(words) == 3 and connect(topic, publisher, (str(words[1]), int(words[2]))):
            return 1, f"connecting {topic}", 0
        result: tuple[int, str, int] = original(topic, publisher, words)
        return result

    handler.create_transport = create_transport
    rospy.init_node("rosbridge", disable_signals=True, disable_rosout=True)
