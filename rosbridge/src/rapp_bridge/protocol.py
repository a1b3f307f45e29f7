"""rosbridge v2 messages as clients send them. No I/O.

Operations and field types as in ROSBRIDGE_PROTOCOL.md of rosbridge_suite (branch ros1), section 3.
"""

from dataclasses import dataclass
from typing import Any, Literal, get_args

Id = str | int | None
Compression = Literal["none", "png", "cbor", "cbor-raw"]
Level = Literal["info", "warning", "error", "none"]
COMPRESSIONS: tuple[Compression, ...] = get_args(Compression)
"""The less demanding first: of several, a client with one connection gets the last."""
LEVELS: tuple[Level, ...] = get_args(Level)


@dataclass(frozen=True)
class Advertise:
    """A client will publish on `topic`."""

    topic: str
    type: str
    id: Id = None
    latch: bool = False
    queue_size: int = 100


@dataclass(frozen=True)
class Unadvertise:
    """The client publishes on `topic` no longer."""

    topic: str
    id: Id = None


@dataclass(slots=True)  # not frozen: there may be tens of thousands a second
class Publish:
    """One message for `topic`; `raw`: the fields hold it serialized, as `bytes`."""

    topic: str
    msg: dict[str, Any]
    id: Id = None
    raw: bool = False
    latch: bool = False
    queue_size: int = 100


@dataclass(frozen=True)
class Subscribe:
    """The client wants the messages of `topic`.

    `throttle_rate` in ms, `queue_length` in messages (0: no limit of its own), `fragment_size` in characters. `again`: the
    client holds this subscription already, so what is latched is not sent once more.
    """

    topic: str
    type: str | None = None
    id: Id = None
    throttle_rate: int = 0
    queue_length: int = 0
    fragment_size: int | None = None
    compression: Compression = "none"
    again: bool = False


@dataclass(frozen=True)
class Unsubscribe:
    """The client wants the messages of `topic` no longer."""

    topic: str
    id: Id = None


@dataclass(slots=True)
class CallService:
    """A call of a ROS service; `timeout` in s, None for the bridge's own."""

    service: str
    args: list[Any] | dict[str, Any]
    id: Id = None
    timeout: float | None = None
    fragment_size: int | None = None


@dataclass(frozen=True)
class AdvertiseService:
    """The client answers calls of `service`."""

    service: str
    type: str
    id: Id = None


@dataclass(frozen=True)
class UnadvertiseService:
    """The client answers calls of `service` no longer."""

    service: str
    id: Id = None


@dataclass(slots=True)
class ServiceResponse:
    """The client's answer to one call."""

    service: str
    id: str
    result: bool
    values: Any = None


@dataclass(frozen=True)
class Fragment:
    """A part of a message's text; `num` counts from 0."""

    id: str | int
    num: int
    total: int
    data: str


@dataclass(frozen=True)
class SetLevel:
    """The client wants status messages of this level and above."""

    level: Level
    id: Id = None


@dataclass(frozen=True)
class Auth:
    """Who the client is: a token, or a digest (`mac`) of the token and the other fields, as rosauth makes it."""

    token: str = ""
    mac: str = ""
    client: str = ""
    dest: str = ""
    rand: str = ""
    t: int = 0
    level: str = ""
    end: int = 0
    id: Id = None


Message = (
    Advertise | Unadvertise | Publish | Subscribe | Unsubscribe | CallService | AdvertiseService | UnadvertiseService
    | ServiceResponse | Fragment | SetLevel | Auth
)  # fmt: skip
