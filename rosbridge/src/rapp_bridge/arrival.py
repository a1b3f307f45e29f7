"""A message that came from ROS, encoded once for all clients that want it in the same way."""

from collections.abc import Callable
from typing import Any, NamedTuple

from rapp_bridge.clock import now
from rapp_bridge.decoding import Raw
from rapp_bridge.errors import BridgeError, Bug
from rapp_bridge.outgoing import publication
from rapp_bridge.protocol import Compression
from rapp_bridge.websocket import Frame

SLOW = 1 << 14  # bytes of a message from which a picture of it is made in a thread

Background = Callable[[Callable[[], object], Callable[[], object]], None]
"""Runs the first function in a thread, then the second where it was called from."""


class Wire(NamedTuple):
    """How a client wants a topic's messages."""

    topic: str  # as the client wrote it
    compression: Compression
    fragment_size: int | None


class Arrival:
    """One message; it is encoded when the first client is ready for it, so what is dropped costs nothing."""

    __slots__ = ("_cls", "_frames", "_stamp", "_waiting", "raw")

    def __init__(self, raw: Raw, cls: Any) -> None:
        """`cls`: the message's class, None when it is not known."""
        self.raw = raw
        self._cls = cls
        self._stamp = now() if cls is None else None
        self._frames: dict[Wire, Frame | BridgeError] = {}
        self._waiting: dict[Wire, list[Callable[[], object]]] = {}

    def frame(self, wire: Wire) -> Frame:
        """The message as this wire wants it; raises BridgeError."""
        found = self._frames.get(wire)
        if found is None:
            found = self._frames[wire] = self._encoded(wire)
        if isinstance(found, BridgeError):
            raise found
        return found

    def is_ready(self, wire: Wire, background: Background, done: Callable[[], object]) -> bool:
        """Whether `frame` is quick; if not, it is prepared in the background and `done` is called after that."""
        if wire.compression != "png" or len(self.raw) < SLOW or wire in self._frames:
            return True
        if wire in self._waiting:
            self._waiting[wire].append(done)
        else:
            self._waiting[wire] = [done]
            background(lambda: self._prepare(wire), lambda: self._prepared(wire))
        return False

    def _prepare(self, wire: Wire) -> None:
        self._frames[wire] = self._encoded(wire)

    def _prepared(self, wire: Wire) -> None:
        self._frames.setdefault(wire, Bug(f"cannot encode a message of {wire.topic}; see the bridge's log"))
        for done in self._waiting.pop(wire):
            done()

    def _encoded(self, wire: Wire) -> Frame | BridgeError:
        try:
            return publication(wire.topic, self.raw, self._cls, wire.compression, wire.fragment_size, self._stamp or now())
        except BridgeError as error:
            return error
