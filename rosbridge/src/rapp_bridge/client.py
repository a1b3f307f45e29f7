"""What the ROS side knows of a connected client: ways to send to it that never block."""

from typing import Protocol


class Client(Protocol):
    """A connected client; all methods may be called from any thread."""

    def send(self, frame: bytes) -> None:
        """Queue an answer or a request; a client that lets too many wait is disconnected."""

    def offer(self, topic: str, frame: bytes, queue_length: int) -> None:
        """Queue a topic's message; the oldest of that topic is dropped when `queue_length` of it wait already."""
