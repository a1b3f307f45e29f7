"""What the ROS side knows of a connected client: ways to send to it that never block."""

from collections.abc import Callable
from typing import Protocol

from rapp_bridge.access import Access
from rapp_bridge.arrival import Arrival, Wire
from rapp_bridge.protocol import Level
from rapp_bridge.websocket import Frame


class Client(Protocol):
    """A connected client; all methods belong to the event loop's thread."""

    @property
    def access(self) -> Access:
        """What the client may use."""

    def send(self, frame: Frame) -> None:
        """Queue an answer or a request; a client that lets too many wait is disconnected."""

    def offer(self, arrival: Arrival, wire: Wire, queue_length: int) -> None:
        """Queue a topic's message; the oldest of that topic is dropped when `queue_length` (0: any number) wait already."""

    @property
    def is_behind(self) -> bool:
        """Whether much waits for the client, which may well read it soon; False once it was waited for in vain."""

    @property
    def is_preparing(self) -> bool:
        """Whether what goes to the client next is still being encoded."""

    def when_caught_up(self, call: Callable[[], object]) -> None:
        """Have this called when nothing waits for the client any more, or it is gone."""

    def give_up(self) -> None:
        """It was waited for in vain: it is not `is_behind` again before it has caught up."""

    def tell(self, level: Level, text: str) -> None:
        """Send a status, if the client wants those of this level."""
