"""The bridge put together: ROS on one side, clients on the other."""

import asyncio
import logging
import socket
import ssl
from collections.abc import Sequence
from typing import Any

import rosgraph
import rospy

from rapp_bridge.access import Gate
from rapp_bridge.blocking import Blocking
from rapp_bridge.calls import Calls
from rapp_bridge.config import Config
from rapp_bridge.doorway import Doorway, Porch
from rapp_bridge.errors import Invalid
from rapp_bridge.graph import Graph
from rapp_bridge.local import Locals
from rapp_bridge.master import Master
from rapp_bridge.node import Door
from rapp_bridge.offers import Offers
from rapp_bridge.presence import Presence
from rapp_bridge.publications import Publications
from rapp_bridge.ros import Ros
from rapp_bridge.rosapi import Rosapi
from rapp_bridge.rostypes import service_class
from rapp_bridge.server import Hall
from rapp_bridge.subscriptions import Subscriptions
from rapp_bridge.websocket import GOING_AWAY
from rapp_ros.rejoin import Rejoining

SWEEP = 1.0  # s between looks for what has grown old
CLIENT_BACKLOG = 1024  # clients that may connect at once

_log = logging.getLogger(__name__)


class Bridge:
    """All parts, opened and closed together. To be made on the event loop, before ROS is joined."""

    def __init__(self, config: Config, gate: Gate, blocking: Blocking) -> None:
        self._config = config
        self._blocking = blocking
        name = rosgraph.names.resolve_name("rosbridge", rosgraph.names.get_ros_namespace())
        master = Master(rosgraph.get_master_uri(), name, config.master_timeout)
        self._publications = Publications(config, master, blocking)
        self._subscriptions = Subscriptions(config, master, blocking)
        self._offers = Offers(config, blocking)
        self._own = Locals(config, blocking, self._offers)
        self._calls = Calls(config, master, blocking, name)
        self._rosapi = Rosapi(Graph(config, master, blocking, self._offers, name), master, blocking)
        self._presence = Presence(self._publications)
        ros = Ros(config, self._publications, self._subscriptions, self._calls, self._offers, self._own)
        changed = _nothing if config.guest else self._presence.changed
        self._hall = Hall(config, ros, gate, rospy.resolve_name, blocking.background, changed)
        self._rejoining: Rejoining | None = None
        self.door = Door(self._publications, self._own)
        self.connect = self._subscriptions.connect

    async def open(self, tls: ssl.SSLContext | None) -> int:
        """Offer the bridge's own services and topics, and serve clients; gives the port. ROS has been joined."""
        config = self._config
        if not config.guest:
            await self._rosapi.offer(self._own)
            await self._presence.begin(self._hall)
        await self._load(config.service_types)
        self._server = await self._listen(tls)
        port: int = self._server.sockets[0].getsockname()[1]
        if not config.guest:
            await self._blocking.run(rospy.set_param, "~actual_port", port)
            self._rejoining = Rejoining()
        self._sweeping = asyncio.create_task(self._sweep())
        return port

    async def _load(self, types: Sequence[str]) -> None:
        for name in types:
            try:
                await self._blocking.run(service_class, name)
            except Invalid as error:
                _log.warning("%s", error)  # a call says so too

    async def _listen(self, tls: ssl.SSLContext | None) -> asyncio.Server:
        config = self._config
        place: dict[str, Any] = {"host": config.address, "port": config.port}
        if config.listener >= 0:
            place = {"sock": socket.socket(fileno=config.listener)}
        return await asyncio.get_running_loop().create_server(
            lambda: Porch(self._hall, tls) if tls else Doorway(self._hall), backlog=CLIENT_BACKLOG, **place
        )

    async def close(self, seconds: float) -> None:
        """End all connections; what clients held is given up, as far as that takes no longer than so many seconds."""
        if self._rejoining is not None:
            self._rejoining.close()
        self._sweeping.cancel()
        self._server.close()
        self._offers.close()
        self._presence.close()
        for client in list(self._hall.clients):
            client.close(GOING_AWAY, "the bridge ends")
        await asyncio.sleep(0)
        for transport in list(self._hall.sockets):
            transport.close()
        end = asyncio.get_running_loop().time() + seconds
        while (self._hall.working or self._hall.sockets) and asyncio.get_running_loop().time() < end:
            await asyncio.sleep(0.02)
        for transport in list(self._hall.sockets):
            transport.abort()
        self._calls.close()

    async def _sweep(self) -> None:
        while True:
            await asyncio.sleep(SWEEP)
            self._calls.sweep()
            await self._publications.sweep()
            await self._subscriptions.sweep()


def _nothing() -> None:
    """Nobody is told of a guest's clients."""
