"""A place beside the services of a server: a prefix of paths, and who answers there."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

from rapp_hop.protocol import WireAnswer, WireRequest


@dataclass(frozen=True)
class Visit:
    """A request to a mount."""

    caller: str  # whom the token names; empty at a public mount
    rest: str  # of the path, after the mount's prefix
    request: WireRequest
    address: str  # of the peer


@dataclass(frozen=True)
class Mount:
    """A place beside the services: every path that begins with `prefix` goes to `handler`, errors in the caller's form."""

    prefix: str  # such as /hop/agents/
    handler: Callable[[Visit], Awaitable[WireAnswer]]
    public: bool = False  # served without token
    max_body: int = 0  # bytes
    methods: frozenset[str] = field(default=frozenset({"GET", "HEAD", "PUT", "POST"}))
