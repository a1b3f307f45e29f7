"""What the parts of the server hand to each other: a request's head, and the job that answers it."""

from dataclasses import dataclass
from typing import Protocol

from rapp_hop.errors import HopError
from rapp_hop.protocol import Body, WireAnswer, WireRequest


@dataclass(slots=True)
class Head:
    """A request before its body."""

    method: str
    path: str
    query: str
    headers: dict[str, str]  # names in lower case
    address: str  # of the peer

    def with_body(self, body: Body) -> WireRequest:
        """Return the whole request."""
        return WireRequest(self.method, self.path, self.headers, body, self.query)


class Job(Protocol):
    """Answers one request."""

    max_body: int  # bytes

    async def run(self, body: Body) -> WireAnswer:
        """Answer; an error is an answer too."""

    def failed(self, error: HopError) -> WireAnswer:
        """Return the answer for an error that came before the body was whole."""

    async def done(self) -> None:
        """Clean up; the answer has been sent, or could not be."""
