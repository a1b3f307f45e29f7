"""The side towards ROS: roslibpy over rosbridge, in twisted's reactor thread.

Requests are handed to the loop of the main thread and answered from there, so a handler never blocks the reactor.
roslibpy's own Service and Topic re-announce themselves by a timer and add their listeners anew each time, so a bridge
that comes back would be answered twice; here everything is announced by plain messages, once per connection.
"""

import asyncio
import json
import logging
import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import roslibpy

from rapp_hop.errors import HopError, Invalid
from rapp_link.events import MESSAGE, Event
from rapp_link.threads import in_thread

_log = logging.getLogger(__name__)

OnRequest = Callable[[str, str, str, float], object]  # service, job, arguments, time-out in seconds
OnCancel = Callable[[str], None]
OnRun = Callable[[str], None]

PREFIX = "rapp_hop/"
REQUEST = "rapp_msgs/HopRequest"
HELD = 200  # events kept while the bridge is away
FIRST_PAUSE, LONGEST_PAUSE = 0.2, 1.0  # seconds between attempts to connect
HANDSHAKE, PING, PONG = 5, 5, 5  # seconds


class RosSide:
    """The link's services and topics on the robot's ROS graph; `open` has its undo in `close`."""

    def __init__(self, url: str, services: Sequence[str], on_request: OnRequest, on_cancel: OnCancel, on_run: OnRun) -> None:
        """Prepare; connects not yet.

        :param url: of the rosbridge, such as ws://127.0.0.1:9090
        :param services: names offered below rapp_hop/
        :param on_request: called in the loop; what it raises is the reason for the refusal
        :param on_cancel: called in the loop with a job's id
        :param on_run: called in the loop with the name of a run that the core agent says lives
        :raises Invalid: not a WebSocket URL
        """
        if not url.startswith(("ws://", "wss://")):
            raise Invalid(f"cannot reach rosbridge at {url!r}: give a URL such as ws://127.0.0.1:9090")
        self._url = url
        self._services = tuple(services)
        self._on_request = on_request
        self._on_text = {"cancel": on_cancel, "runs": on_run}  # by topic
        self._held: deque[Event] = deque(maxlen=HELD)
        self._lock = threading.Lock()  # of `_connected` and `_held`
        self._connected = False
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ros: Any = None

    @property
    def connected(self) -> bool:
        """Tell whether the bridge is there."""
        return self._connected

    def open(self) -> None:
        """Begin to connect, and to connect again whenever the bridge was away; returns at once."""
        self._loop = asyncio.get_running_loop()
        self._ros = roslibpy.Ros(self._url)
        factory = self._ros.factory
        factory.initialDelay = factory.delay = FIRST_PAUSE
        factory.maxDelay = LONGEST_PAUSE
        factory.setProtocolOptions(openHandshakeTimeout=HANDSHAKE, autoPingInterval=PING, autoPingTimeout=PONG)
        self._ros.on("ready", self._announce)
        self._ros.on("close", self._lost)
        for topic, take in self._on_text.items():
            self._ros.on(f"{PREFIX}{topic}", lambda message, take=take: self._hand_over(take, str(message.get("data", ""))))
        for name in self._services:
            self._ros.on(f"{PREFIX}{name}", lambda message, name=name: self._hand_over(self._answer, name, message))
        factory.manager.run()

    async def close(self) -> None:
        """Leave the bridge and end the reactor; a second call does nothing."""
        ros, self._ros = self._ros, None
        if ros is not None:
            with self._lock:
                self._connected = False
            try:
                await asyncio.wait_for(in_thread(ros.terminate), 1.0)
            except (TimeoutError, roslibpy.core.RosTimeoutError):
                _log.warning("cannot leave rosbridge in time: leaving without farewell")

    def tell(self, event: Event) -> None:
        """Publish an event; while the bridge is away it waits, the oldest is forgotten first; messages do not wait."""
        with self._lock:
            if not self._connected:
                if event.kind != MESSAGE:
                    self._held.append(event)
                return
        self._publish("events", event.fields())

    def alive(self, sign: dict[str, object]) -> None:
        """Publish a sign of life; dropped while the bridge is away."""
        if self._connected:
            self._publish("alive", {"data": json.dumps(sign)})

    def _announce(self, protocol: Any) -> None:
        protocol.transport.setTcpNoDelay(True)  # what follows an answer would wait 40 ms for the bridge's acknowledgement
        # roslibpy has no handler for `status` and logs a stack trace without the text of the error instead.
        protocol._message_handlers["status"] = lambda message: _log.error("rosbridge says: %s", message.get("msg"))
        for topic, kind in (("events", "rapp_msgs/HopEvent"), ("alive", "std_msgs/String")):
            self._send({"op": "advertise", "topic": PREFIX + topic, "type": kind, "queue_size": 1000})
        for topic in self._on_text:
            self._send({"op": "subscribe", "topic": PREFIX + topic, "type": "std_msgs/String", "queue_length": 100})
        for name in self._services:
            self._send({"op": "advertise_service", "service": PREFIX + name, "type": REQUEST})
        with self._lock:
            self._connected = True
            held = list(self._held)
            self._held.clear()
        for event in held:
            self._publish("events", event.fields())
        _log.info("rosbridge is there: %s", self._url)

    def _lost(self, _protocol: Any) -> None:
        with self._lock:
            was, self._connected = self._connected, False
        if was:
            _log.warning("rosbridge is away: %s, trying to connect again", self._url)

    def _hand_over(self, work: Callable[..., None], *arguments: Any) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(work, *arguments)

    def _answer(self, name: str, message: Any) -> None:
        accepted, reason = True, ""
        try:
            wish = message["args"]
            self._on_request(name, str(wish["job"]), str(wish["arguments"]), float(wish["timeout"]))
        except HopError as error:
            accepted, reason = False, str(error)
        except (KeyError, TypeError, ValueError) as error:
            accepted, reason = False, f"cannot read the request: {error}, ask as rapp_msgs/HopRequest says"
        if self._connected:
            values = {"accepted": accepted, "message": reason}
            answer = {"op": "service_response", "service": PREFIX + name, "values": values, "result": True}
            self._send(answer | ({"id": message["id"]} if "id" in message else {}))

    def _publish(self, topic: str, fields: dict[str, Any]) -> None:
        self._send({"op": "publish", "topic": PREFIX + topic, "msg": fields})

    def _send(self, message: dict[str, Any]) -> None:
        ros = self._ros
        if ros is not None:
            ros.send_on_ready(roslibpy.Message(message))
