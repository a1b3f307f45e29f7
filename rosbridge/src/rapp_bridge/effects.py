"""What a session wants done, and what it may hold."""

from dataclasses import dataclass

from rapp_bridge.protocol import Message
from rapp_bridge.websocket import Frame


@dataclass(frozen=True)
class Send:
    """Send this frame to the client."""

    frame: Frame


@dataclass(frozen=True)
class Close:
    """End the connection."""

    code: int
    reason: str


Effect = Send | Close | Message
"""A message among the effects is to be carried out on the ROS side; when that fails, `Session.failed` says what follows."""


@dataclass(frozen=True)
class Limits:
    """What one client may hold."""

    names: int  # ids of topics and services at once
    calls: int  # calls that are open
    fragments: int  # characters of unfinished messages
    fragment_seconds: float  # s until an unfinished message is forgotten
