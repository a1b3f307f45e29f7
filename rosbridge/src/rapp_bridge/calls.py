"""Calls of ROS services by clients, over pooled persistent connections, on the event loop."""

import asyncio
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from rapp_bridge.blocking import Blocking
from rapp_bridge.config import Config
from rapp_bridge.decoding import Raw, decode
from rapp_bridge.encoding import encode_arguments
from rapp_bridge.errors import BridgeError, Invalid, Refused, Unreachable
from rapp_bridge.forms import JSON, Piece, json_pieces
from rapp_bridge.links import Outgoing
from rapp_bridge.master import Master, Unregistered
from rapp_bridge.rostypes import service_class

PAUSE = 0.5  # s until another connection is tried when one could not be opened, and others are

Outcome = list[Piece] | BridgeError
"""The JSON of a response's fields, or why there is none."""
Done = Callable[[Outcome], object]


class _Call:
    """One call; whoever settles it first decides its outcome."""

    __slots__ = ("args", "done", "timer")

    def __init__(self, args: list[Any] | dict[str, Any], done: Done) -> None:
        self.args = args
        self.done: Done | None = done
        self.timer: Any = None

    def settle(self, outcome: Outcome) -> None:
        done, self.done = self.done, None
        if done is not None:
            self.timer.cancel()
            done(outcome)


class _Connection:
    """A persistent connection to a service; one call at a time."""

    def __init__(self, name: str, line: "_Line", link: Outgoing, address: tuple[str, int], cls: Any) -> None:
        self._name = name
        self._line = line
        self.link = link
        self.address = address
        self.cls = cls
        self.born = asyncio.get_running_loop().time()
        self._call: _Call | None = None
        link.on_message = self._answered
        link.on_lost = self._lost

    def begin(self, call: _Call) -> bool:
        """Send a call's request; False when the call has failed by its arguments, and the connection is free."""
        try:
            request = encode_arguments(call.args, self.cls._request_class)
        except BridgeError as error:
            call.settle(error)
            return False
        self._call = call
        self.link.transport.write(len(request).to_bytes(4, "little") + request)
        return True

    def retire(self) -> None:
        """Take no further call: the service is no longer where this leads."""
        self.born = float("-inf")
        if self._call is None:
            self.link.close()

    def has(self, call: _Call) -> bool:
        """Whether this call waits for its answer here."""
        return self._call is call

    def _answered(self, raw: Raw) -> None:
        call, self._call = self._call, None
        if call is None:
            self.link.close()  # nothing was asked
            return
        self._line.free(self)
        call.settle(self._outcome(raw))

    def _outcome(self, raw: Raw) -> Outcome:
        body = raw[1:]
        if not raw[0]:
            return Refused(f"cannot call {self._name}: it answered with an error: {body.decode(errors='replace')}")
        try:
            return json_pieces(decode(body, self.cls._response_class, JSON))
        except BridgeError as error:
            return error

    def _lost(self) -> None:
        self._line.lost(self)
        if self._call is not None:
            text = f"cannot know what became of the call of {self._name}: its node closed the connection"
            self._call.settle(Unreachable(text))


@dataclass(eq=False)
class _Line:
    """The connections to one service, and the calls that wait for one of them.

    Connections are opened one after another: rospy's servers listen with a backlog of 5, and one that finds it full waits a
    second for its next try. They are used last in, first out, so that those in excess grow old.
    """

    age: float
    idle: list[_Connection] = field(default_factory=list)
    waiting: deque[_Call] = field(default_factory=deque)
    opened: set[_Connection] = field(default_factory=set)
    opening: asyncio.Task[None] | None = None
    more: Callable[[], object] = lambda: None
    """Opens another connection when calls wait."""

    def free(self, connection: _Connection) -> None:
        """The connection can take the next call."""
        if asyncio.get_running_loop().time() - connection.born > self.age:
            connection.link.close()
            return
        while self.waiting:
            call = self.waiting.popleft()
            if call.done is not None and connection.begin(call):
                return
        self.idle.append(connection)

    def take(self) -> _Connection | None:
        """A connection that is free and still open."""
        while self.idle:
            connection = self.idle.pop()
            if connection.link.is_open:
                return connection
        return None

    def lost(self, connection: _Connection) -> None:
        """The connection is gone."""
        self.opened.discard(connection)
        if connection in self.idle:
            self.idle.remove(connection)
        self.more()


class Calls:
    """Calls of ROS services. A call is made once: when its fate is unknown it fails, and is never repeated."""

    def __init__(self, config: Config, master: Master, blocking: Blocking, caller: str) -> None:
        self._config = config
        self._master = master
        self._blocking = blocking
        self._caller = caller
        self._lines: dict[str, _Line] = {}
        self._looking: asyncio.Task[None] | None = None

    def call(self, name: str, args: list[Any] | dict[str, Any], seconds: float, done: Done) -> None:
        """Call the service of this global name; `done` gets the outcome, once, within `seconds`."""
        line = self._lines.get(name)
        if line is None:
            line = self._lines[name] = _Line(self._config.connection_age)
            line.more = partial(self._open_more, name, line)
        call = _Call(args, done)
        call.timer = asyncio.get_running_loop().call_later(seconds, self._late, name, call, seconds)
        connection = line.take()
        if connection is None:
            line.waiting.append(call)
            line.more()
        elif not connection.begin(call):
            line.free(connection)

    def sweep(self) -> None:
        """Close connections that are idle and old, or lead to where their service is no longer; to be called now and then."""
        old = asyncio.get_running_loop().time() - self._config.connection_age
        for name, line in list(self._lines.items()):
            for connection in [each for each in line.idle if each.born < old]:
                connection.link.close()
                line.lost(connection)
            if not line.opened and not line.waiting and line.opening is None:
                del self._lines[name]
        if self._looking is None or self._looking.done():
            self._looking = asyncio.get_running_loop().create_task(self._look())

    async def _look(self) -> None:
        """Ask the master, one question after another, where the services are that connections are kept to."""
        for name, line in list(self._lines.items()):
            if not line.opened:
                continue
            address: tuple[str, int] | None = None
            try:
                address = await self._blocking.run(self._master.service_address, name)
            except Unregistered:
                pass
            except Unreachable:
                return  # the master is away, and the services may well be there
            for connection in [each for each in line.opened if each.address != address]:
                connection.retire()

    def close(self) -> None:
        """Close all connections."""
        if self._looking is not None:
            self._looking.cancel()
        for line in self._lines.values():
            line.waiting.clear()
            if line.opening is not None:
                line.opening.cancel()
            for connection in list(line.opened):
                connection.link.close()

    def _late(self, name: str, call: _Call, seconds: float) -> None:
        call.settle(Unreachable(f"cannot wait longer for {name}: no answer in {seconds:g} s"))
        line = self._lines[name]  # it is there as long as one of its calls
        if call in line.waiting:
            line.waiting.remove(call)
        for connection in list(line.opened):
            if connection.has(call):
                connection.link.close()  # its answer would be taken for that of the next call

    def _open_more(self, name: str, line: _Line) -> None:
        if line.waiting and line.opening is None and len(line.opened) < self._config.connections:
            line.opening = asyncio.get_running_loop().create_task(self._open(name, line))
            line.opening.add_done_callback(lambda _: self._opened(line))

    @staticmethod
    def _opened(line: _Line) -> None:
        line.opening = None
        line.more()

    async def _open(self, name: str, line: _Line) -> None:
        """Open one connection; when that fails, so do the calls that wait, unless another may still become free for them."""
        try:
            connection = await self._connected(name, line)
        except BridgeError as error:
            if line.opened and not isinstance(error, Unregistered):
                await asyncio.sleep(PAUSE)
                return
            calls = list(line.waiting)
            line.waiting.clear()
            for call in calls:
                call.settle(error)
            return
        line.opened.add(connection)
        line.free(connection)

    async def _connected(self, name: str, line: _Line) -> _Connection:
        address = await self._blocking.run(self._master.service_address, name)
        header = {"service": name, "md5sum": "*", "callerid": self._caller, "persistent": "1"}
        link = Outgoing(header, self._config.response_limit, has_status=True)
        try:
            fields = await link.connect(address, self._config.master_timeout)
        except Unreachable as error:
            raise Unreachable(f"cannot call {name}: {error}; see that its node runs") from error
        if "type" not in fields:
            link.close()
            raise Unreachable(f"cannot call {name}: its node does not say its type")
        try:
            cls = service_class(fields["type"])
            if fields.get("md5sum", cls._md5sum) != cls._md5sum:
                raise Invalid(f"cannot call {name}: its {fields['type']} is another version than the one built here")
        except Invalid:
            link.close()
            raise
        return _Connection(name, line, link, address, cls)
