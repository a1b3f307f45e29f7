"""How the robot stands with its platform, by the link's sign of life."""

import asyncio
import json
from typing import Any

from tornado.websocket import WebSocketError, websocket_connect

ALIVE = {"op": "subscribe", "topic": "/rapp_hop/alive", "type": "std_msgs/String"}


async def registered(bridge: str, patience: float) -> bool | None:
    """Whether the robot is registered with the platform; None when the link does not say so within `patience` s.

    :param bridge: WebSocket URL of the rosbridge
    """
    try:
        async with asyncio.timeout(patience):
            socket = await websocket_connect(bridge, connect_timeout=patience)
            try:
                await socket.write_message(json.dumps(ALIVE))
                message: dict[str, Any] = json.loads(await socket.read_message() or "{}")
                return bool(json.loads(message["msg"]["data"])["cloud"])
            finally:
                socket.close()
    except (OSError, WebSocketError, TimeoutError, ValueError, KeyError, TypeError):
        return None
