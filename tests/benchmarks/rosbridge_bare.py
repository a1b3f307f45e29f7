"""What the machine allows: a bare Tornado WebSocket server that echoes, or pushes as many frames as it is told.

    python rosbridge_bare.py        prints READY {"port": ...}

"push SIZE COUNT" sends that many frames to who asks, "fan SIZE COUNT" to all who are connected.
"""

import asyncio
import json

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application
from tornado.websocket import WebSocketHandler

clients: set["Bare"] = set()


class Bare(WebSocketHandler):
    """One connection."""

    def check_origin(self, origin: str) -> bool:
        return True

    def open(self) -> None:
        self.set_nodelay(True)
        clients.add(self)

    def on_close(self) -> None:
        clients.discard(self)

    async def on_message(self, message: str | bytes) -> None:
        words = str(message).split(" ")
        if words[0] not in ("push", "fan"):
            self.write_message(message)
            return
        data, receivers = "x" * int(words[1]), clients if words[0] == "fan" else {self}
        for _ in range(int(words[2])):
            await asyncio.gather(*(receiver.write_message(data) for receiver in receivers))


async def main() -> None:
    (listening,) = bind_sockets(0, "127.0.0.1")
    HTTPServer(Application([("/", Bare)])).add_socket(listening)
    print("READY " + json.dumps({"port": listening.getsockname()[1]}), flush=True)
    await asyncio.Event().wait()


asyncio.run(main())
