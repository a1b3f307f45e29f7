"""Tells ROS which clients are connected: the latched topics /client_count and /connected_clients."""

import asyncio
from typing import Any, cast

from rapp_bridge.client import Client
from rapp_bridge.protocol import Advertise
from rapp_bridge.publications import Publications
from rapp_bridge.server import Hall

COUNT, CLIENTS = "/client_count", "/connected_clients"
PAUSE = 0.05  # s in which changes are gathered


class Presence:
    """Publishes the count and the list, a moment after they have changed."""

    def __init__(self, publications: Publications) -> None:
        self._publications = publications
        self._timer: asyncio.TimerHandle | None = None

    async def begin(self, hall: Hall) -> None:
        """Advertise both topics and tell that there is nobody yet."""
        self._hall = hall
        for topic, kind in ((COUNT, "std_msgs/Int32"), (CLIENTS, "rosbridge_msgs/ConnectedClients")):
            waiting = self._publications.advertise(cast(Client, self), Advertise(topic, kind, None, latch=True))
            if waiting is not None:
                await waiting
        self._tell()

    def changed(self) -> None:
        """A client has come or gone."""
        if self._timer is None:
            self._timer = asyncio.get_running_loop().call_later(PAUSE, self._tell)

    def close(self) -> None:
        """Tell no more."""
        if self._timer is not None:
            self._timer.cancel()

    def _tell(self) -> None:
        self._timer = None
        clients: list[dict[str, Any]] = [
            {"ip_address": address, "connection_time": {"secs": since[0], "nsecs": since[1]}}
            for address, since in self._hall.clients.values()
        ]
        self._publications.publish_own(COUNT, {"data": len(clients)})
        self._publications.publish_own(CLIENTS, {"clients": clients})
