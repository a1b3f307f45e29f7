"""Connections of clients: each has a session, and serves its messages in order."""

import asyncio
import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from rapp_bridge.access import EVERYTHING, Access, Gate
from rapp_bridge.arrival import Background
from rapp_bridge.clock import now
from rapp_bridge.config import Config
from rapp_bridge.effects import Close, Effect, Limits, Send
from rapp_bridge.errors import BridgeError
from rapp_bridge.forms import Piece
from rapp_bridge.protocol import CallService, Level, Message, Publish
from rapp_bridge.ros import Ros
from rapp_bridge.sender import Sender
from rapp_bridge.session import Session
from rapp_bridge.websocket import CLOSE, FAILED, NORMAL, PING, POLICY, PONG, TOO_BIG, Reader, Received, ViolationError, frame

TURN = 0.002  # s that one client's messages are served before others get their turn
BACKLOG = 1024  # messages read ahead of those that are served; their bytes are bounded as one message's

_log = logging.getLogger(__name__)


@dataclass
class Hall:
    """What all connections share."""

    config: Config
    ros: Ros
    gate: Gate
    resolve: Callable[[str], str]
    background: Background
    changed: Callable[[], None]  # called when a client has come or gone
    clients: dict["Connection", tuple[str, tuple[int, int]]] = field(default_factory=dict)  # to address and time of coming
    sockets: set[Any] = field(default_factory=set)  # all transports, those in their handshake too
    knocking: set[Any] = field(default_factory=set)  # sockets that do not speak TLS yet
    working: set[asyncio.Task[None]] = field(default_factory=set)  # for clients, those that are gone too

    @property
    def excess(self) -> int:
        """Connections above the limit."""
        return len(self.sockets) + len(self.knocking) - self.config.clients

    def limits(self) -> Limits:
        """What a client may hold."""
        config = self.config
        return Limits(config.names, config.calls, config.frame_limit, config.fragment_timeout)

    def work(self, coroutine: Any) -> None:
        """Run it; what goes wrong in it is logged."""
        task = asyncio.get_running_loop().create_task(coroutine)
        self.working.add(task)
        task.add_done_callback(self._worked)

    def _worked(self, task: asyncio.Task[None]) -> None:
        self.working.discard(task)
        if not task.cancelled() and (error := task.exception()):
            _log.error("work for a client", exc_info=error)


class Connection(asyncio.Protocol):
    """One client. A message that has to wait for the ROS master keeps the client's next ones waiting, nobody else's."""

    def __init__(self, hall: Hall, transport: Any, access: Access | None) -> None:
        """`access`: who the client is, when it has shown that in the handshake."""
        self._hall = hall
        self._transport = transport
        self._loop = asyncio.get_running_loop()
        config = hall.config
        self._session = Session(hall.limits(), hall.gate, hall.resolve, access)
        self._sender = Sender(transport, config.queue_limit, hall.background, self.tell, self.close)
        self._reader = Reader(config.frame_limit)
        self._received: deque[Received] = deque()
        self._unserved, self._most = 0, config.frame_limit  # bytes that have come since all messages were served
        self._busy = self._turn_is_set = self._over = self._gone = False
        self._second, self._count = 0.0, 0  # of the rate limit
        self._heard = True
        self._timer = self._loop.call_later(config.entry_timeout, self._entry_is_over)
        self.send, self.offer = self._sender.send, self._sender.offer
        self.when_caught_up, self.give_up = self._sender.when_caught_up, self._sender.give_up
        self._enter()

    # The socket's events

    def data_received(self, data: bytes) -> None:
        """Bytes have come."""
        if self._over:
            return
        self._heard = True
        try:
            received = self._reader.feed(data)
            self._count_rate(len(received))
        except ViolationError as error:
            if error.code in (POLICY, TOO_BIG):
                self.tell("error", str(error))
            self.close(error.code, str(error))
            return
        self._received.extend(received)
        self._unserved += len(data)
        self._serve()

    def eof_received(self) -> bool:
        """The client sends no more; it is closed from this side too."""
        return False

    def connection_lost(self, _error: Exception | None) -> None:
        """The client is gone: end the session, and undo in order what it left behind."""
        self._gone = self._over = True
        self._timer.cancel()
        self._received.clear()
        self._sender.close()
        self._hall.sockets.discard(self._transport)
        if self._hall.clients.pop(self, None) is not None:
            self._hall.changed()
        self._hall.ros.abandon(self)
        if not self._busy:
            self._hall.work(self._undo(self._session.close()))

    def pause_writing(self) -> None:
        """The client reads more slowly than it is sent to."""
        self._sender.pause()

    def resume_writing(self) -> None:
        """The client has caught up."""
        self._sender.resume()

    # What the ROS side uses, beside what is the sender's

    @property
    def access(self) -> Access:
        """What the client may use."""
        return self._session.access or EVERYTHING

    @property
    def is_behind(self) -> bool:
        """Whether much waits for the client."""
        return self._sender.is_behind

    @property
    def is_preparing(self) -> bool:
        """Whether what goes to the client next is still being encoded."""
        return self._sender.is_preparing

    def tell(self, level: Level, text: str) -> None:
        """Send a status, if the client wants those of this level."""
        self._do(self._session.tell(level, text))

    def close(self, code: int, reason: str) -> None:
        """Say farewell; a client that does not answer it is cut off."""
        if not self._over:
            self._over = True
            self._received.clear()
            self._read_on(True)
            self._sender.farewell(code, reason)
            self._timer.cancel()
            self._timer = self._loop.call_later(self._hall.config.entry_timeout, self._transport.abort)

    # How long it may be silent

    def _enter(self) -> None:
        """The client counts as connected once it has shown who it is."""
        if self not in self._hall.clients and self._session.access is not None:
            self._timer.cancel()
            self._timer = self._loop.call_later(self._hall.config.ping_interval, self._ping)
            address = self._transport.get_extra_info("peername") or ("", 0)
            self._hall.clients[self] = (address[0], now())
            self._hall.changed()

    def _entry_is_over(self) -> None:
        self.close(POLICY, "not authenticated in time")

    def _ping(self) -> None:
        if not self._heard:
            self._transport.abort()
            return
        self._heard = False
        self._timer = self._loop.call_later(self._hall.config.ping_interval, self._ping)
        self.send(frame(PING, [b""]))

    # What the client sends

    def _count_rate(self, count: int) -> None:
        now = self._loop.time()
        if now - self._second >= 1.0:
            self._second, self._count = now, 0
        self._count += count
        if self._count > self._hall.config.frame_rate:
            limit = self._hall.config.frame_rate
            raise ViolationError(POLICY, f"cannot serve more than {limit} messages a second; send fewer")

    def _serve(self) -> None:
        """Serve what has come, in order, until something has to be waited for, or others have their turn."""
        end, count = self._loop.time() + TURN, 0
        while self._received and not self._busy and not self._over:
            count += 1
            if count & 15 == 0 and self._loop.time() > end:
                self._take_turn_later()
                break
            self._take(self._received.popleft())
        if not self._received:
            self._unserved = 0
        if not self._over:
            self._read_on(len(self._received) < BACKLOG and self._unserved <= self._most)

    def _take_turn_later(self) -> None:
        if not self._turn_is_set:
            self._turn_is_set = True
            self._loop.call_soon(self._turn)

    def _turn(self) -> None:
        self._turn_is_set = False
        self._serve()

    def _read_on(self, wanted: bool) -> None:
        if self._transport.is_reading() != wanted:
            (self._transport.resume_reading if wanted else self._transport.pause_reading)()

    def _take(self, received: Received) -> None:
        if received.opcode < CLOSE:
            try:
                self._do(self._session.receive(received.data, self._loop.time()))
            except Exception:  # noqa: BLE001 - a bug here must not leave the client connected and unheard
                self._failed()
            if self not in self._hall.clients:
                self._enter()
        elif received.opcode == PING:
            self.send(frame(PONG, [received.data]))
        elif received.opcode == CLOSE:
            self.close(NORMAL, "")

    def _do(self, effects: list[Effect]) -> None:
        for effect in effects:
            if type(effect) is Send:
                self.send(effect.frame)
            elif type(effect) is Close:
                self.close(effect.code, effect.reason)
            else:
                self._perform(effect)  # type: ignore[arg-type]  # mypy does not narrow by type()

    def _perform(self, effect: Message) -> None:
        try:
            if type(effect) is Publish:
                waiting = self._hall.ros.publish(self, effect)
            elif type(effect) is CallService:
                self._hall.ros.call(self, effect, lambda outcome: self._answered(effect, outcome))
                return
            else:
                waiting = self._hall.ros.perform(self, effect)
        except BridgeError as error:
            self._do(self._session.failed(effect, error))
            return
        if waiting is not None:
            self._busy = True
            self._hall.work(self._wait(effect, waiting))

    async def _wait(self, effect: Message, waiting: Any) -> None:
        try:
            await waiting
        except BridgeError as error:
            self._do(self._session.failed(effect, error))
        except Exception:  # noqa: BLE001 - as above
            self._failed()
        finally:
            self._busy = False
            if self._gone:
                self._hall.work(self._undo(self._session.close()))
            else:
                self._serve()

    def _failed(self) -> None:
        _log.exception("a client's message")
        self.close(FAILED, "cannot go on: the bridge failed on your message; see its log, and report it")

    def _answered(self, wish: CallService, outcome: list[Piece] | BridgeError) -> None:
        if not self._gone:
            failed = isinstance(outcome, BridgeError)
            self._do(self._session.failed(wish, outcome) if failed else self._session.answered(wish, outcome))  # type: ignore[arg-type]

    async def _undo(self, effects: list[Effect]) -> None:
        for effect in effects:
            try:
                waiting = self._hall.ros.perform(self, effect)  # type: ignore[arg-type]  # a session closes with messages only
                if waiting is not None:
                    await waiting
            except BridgeError as error:
                _log.warning("a client that left: %s", error)
