"""The WebSocket side: Tornado connections with bounded outgoing queues."""

import asyncio
import logging
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from tornado.httputil import HTTPServerRequest
from tornado.web import Application
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from rapp_bridge.client import Client
from rapp_bridge.config import Config
from rapp_bridge.session import Session

_log = logging.getLogger(__name__)


class Outbox:
    """What waits to be sent to one client: answers are kept, a topic's oldest message is dropped; bounded in bytes.

    Filled by any thread, emptied by the event loop, which is woken once for all that has come meanwhile.
    """

    def __init__(self, limit: int, wake: Callable[[], None]) -> None:
        self._limit = limit
        self._wake = wake
        self._lock = threading.Lock()
        self._items: deque[tuple[str | None, str]] = deque()
        self._waiting: dict[str, int] = {}
        self._bytes = 0
        self.overflown = False

    def put(self, topic: str | None, text: str, queue_length: int = 0) -> None:
        """Add a text; of `topic`, when given, at most `queue_length` texts are kept."""
        with self._lock:
            if topic is not None:
                self._waiting[topic] = self._waiting.get(topic, 0) + 1
                if self._waiting[topic] > queue_length:
                    self._drop_oldest(topic)
            self._items.append((topic, text))
            self._bytes += len(text)
            self.overflown = self.overflown or self._bytes > self._limit
        self._wake()

    def _drop_oldest(self, topic: str) -> None:
        index = next(i for i, (other, _) in enumerate(self._items) if other == topic)
        self._bytes -= len(self._items[index][1])
        del self._items[index]
        self._waiting[topic] -= 1

    def take(self) -> str | None:
        """The next text to send; None when nothing waits."""
        with self._lock:
            if not self._items:
                return None
            topic, text = self._items.popleft()
            self._bytes -= len(text)
            if topic is not None:
                self._waiting[topic] -= 1
            return text


class Connection(WebSocketHandler):
    """One client. Frames are served in order by a thread of their own, so that a slow master delays no other client."""

    def initialize(self, config: Config, open_session: Callable[[Client], Session]) -> None:  # noqa: D102
        self._config = config
        self._open_session = open_session

    def check_origin(self, origin: str) -> bool:
        """Any origin, as upstream; the bridge listens on the loopback interface."""
        return True

    def open(self, *_args: str, **_kwargs: str) -> None:
        """Begin a session."""
        self.set_nodelay(True)
        self._loop = asyncio.get_running_loop()
        self._more = asyncio.Event()
        self._outbox = Outbox(self._config.queue_limit, self._wake)
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="session")
        self._session = self._open_session(self)
        self._writing = asyncio.create_task(self._write())

    async def on_message(self, message: str | bytes) -> None:
        """Serve one frame; the next one is read when it has been served."""
        await self._loop.run_in_executor(self._worker, self._session.receive, message)

    def on_close(self) -> None:
        """End the session; what it left behind is undone in its thread, in order."""
        self._writing.cancel()
        self._worker.submit(self._session.close)
        self._worker.shutdown(wait=False)

    def send(self, text: str) -> None:
        """Queue an answer or a request, from any thread."""
        self._outbox.put(None, text)

    def offer(self, topic: str, text: str, queue_length: int) -> None:
        """Queue a topic's message, from any thread."""
        self._outbox.put(topic, text, queue_length)

    def _wake(self) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._more.set)

    async def _write(self) -> None:
        try:
            while not self._outbox.overflown:
                text = self._outbox.take()
                if text is None:
                    self._more.clear()
                    text = self._outbox.take()
                if text is None:
                    await self._more.wait()
                else:
                    await self.write_message(text)
        except WebSocketClosedError:
            return
        _log.warning("client disconnected: more than %d bytes waited for it", self._config.queue_limit)
        self.close(1008, "too slow")


def application(config: Config, open_session: Callable[[Client], Session]) -> Application:
    """The web application: a WebSocket on every path, as upstream."""
    return Application(
        [(r"/.*", Connection, {"config": config, "open_session": open_session})],
        websocket_max_message_size=config.frame_limit,
        websocket_ping_interval=config.ping_interval,
        websocket_ping_timeout=config.ping_timeout,
        log_function=_no_access_log,
    )


def _no_access_log(_handler: HTTPServerRequest) -> None:
    """Access lines would be noise: a client's failures are told to the client."""
