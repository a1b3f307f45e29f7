"""The WebSocket side: Tornado connections, each with a session and a bounded queue."""

import asyncio
import logging
import threading
from dataclasses import dataclass, field

from tornado.httputil import HTTPServerRequest
from tornado.web import Application
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from rapp_bridge.config import Config
from rapp_bridge.errors import BridgeError, Bug
from rapp_bridge.outbox import Outbox
from rapp_bridge.protocol import CallService
from rapp_bridge.ros import Ros
from rapp_bridge.session import Effect, Send, Session

_log = logging.getLogger(__name__)


@dataclass
class Hall:
    """What all connections share."""

    config: Config
    ros: Ros
    leaving: set[asyncio.Task[None]] = field(default_factory=set)  # of clients that are gone: their undoing


class Connection(WebSocketHandler):
    """One client. Its frames are served in order; the next one is read when the last has been served or begun."""

    def initialize(self, hall: Hall) -> None:  # noqa: D102
        self._hall = hall

    def check_origin(self, origin: str) -> bool:
        """Any origin, as upstream; the bridge listens on the loopback interface."""
        return True

    def open(self, *_args: str, **_kwargs: str) -> None:
        """Begin a session."""
        self.set_nodelay(True)
        config = self._hall.config
        self._loop = asyncio.get_running_loop()
        self._thread = threading.get_ident()
        self._more = asyncio.Event()
        self._outbox = Outbox(config.queue_limit, self._wake, self._overflow)
        self._session = Session(config.names, config.calls)
        self._order = asyncio.Lock()
        self._calls: set[asyncio.Task[None]] = set()
        self._writing = asyncio.create_task(self._write())

    async def on_message(self, message: str | bytes) -> None:
        """Serve one frame."""
        async with self._order:
            await self._carry_out(self._session.receive(message))

    def on_close(self) -> None:
        """End the session, and undo in order what it left behind."""
        self._outbox.close()
        self._writing.cancel()
        for call in self._calls:
            call.cancel()
        self._hall.ros.abandon(self)
        leaving = asyncio.create_task(self._leave())
        self._hall.leaving.add(leaving)
        leaving.add_done_callback(self._hall.leaving.discard)

    def send(self, frame: bytes) -> None:
        """Queue an answer or a request, from any thread."""
        self._outbox.keep(frame)

    def offer(self, topic: str, frame: bytes, queue_length: int) -> None:
        """Queue a topic's message, from any thread."""
        self._outbox.offer(topic, frame, queue_length)

    async def _carry_out(self, effects: list[Effect]) -> None:
        for effect in effects:
            if isinstance(effect, Send):
                self.send(effect.frame)
            elif isinstance(effect, CallService):
                self._begin(effect)
            else:
                try:
                    await self._hall.ros.perform(self, effect)
                except BridgeError as error:
                    await self._carry_out(self._session.failed(effect, error))

    def _begin(self, wish: CallService) -> None:
        task = asyncio.create_task(self._call(wish))
        self._calls.add(task)
        task.add_done_callback(lambda done: self._ended(done, wish))

    async def _call(self, wish: CallService) -> None:
        try:
            effects = self._session.answered(wish, await self._hall.ros.call(wish))
        except BridgeError as error:
            effects = self._session.failed(wish, error)
        await self._carry_out(effects)

    def _ended(self, task: asyncio.Task[None], wish: CallService) -> None:
        self._calls.discard(task)
        error = None if task.cancelled() else task.exception()
        if error is not None:
            _log.error("call of %s", wish.service, exc_info=error)
            for effect in self._session.failed(wish, Bug(f"cannot call {wish.service}: the bridge failed; see its log")):
                if isinstance(effect, Send):
                    self.send(effect.frame)

    async def _leave(self) -> None:
        async with self._order:
            for effect in self._session.close():
                if isinstance(effect, Send):
                    continue
                try:
                    await self._hall.ros.perform(self, effect)
                except BridgeError as error:
                    _log.warning("a client that left: %s", error)

    def _wake(self) -> None:
        if threading.get_ident() == self._thread:
            self._more.set()
        elif not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._more.set)

    def _overflow(self) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._disconnect)

    def _disconnect(self) -> None:
        _log.warning("client disconnected: more than %d bytes of answers waited for it", self._hall.config.queue_limit)
        self._writing.cancel()
        self.close(1008, "too slow")

    async def _write(self) -> None:
        try:
            while True:
                frame = self._outbox.take()
                if frame is None:
                    await self._more.wait()
                    self._more.clear()
                else:
                    await self.write_message(frame)
        except WebSocketClosedError:
            return


def application(hall: Hall) -> Application:
    """The web application: a WebSocket on every path, as upstream."""
    return Application(
        [(r"/.*", Connection, {"hall": hall})],
        websocket_max_message_size=hall.config.frame_limit,
        websocket_ping_interval=hall.config.ping_interval,
        websocket_ping_timeout=hall.config.ping_interval,
        log_function=_no_access_log,
    )


def _no_access_log(_handler: HTTPServerRequest) -> None:
    """Access lines would be noise: a client's failures are told to the client."""
