"""Errors of HOP, split by what the reader does next; each carries the word that travels on the wire."""

from typing import ClassVar


class HopError(Exception):
    """Root of all errors of this package.

    `kind` is the wire word; `status` the HTTP status it came with, when there was one; `reason` a word for programs that
    says what exactly was wrong, where that makes a difference to who is told; `retry_after` the seconds in which who was
    turned away may come again.
    """

    kind: ClassVar[str] = "bug"
    reason: str = ""
    retry_after: int = 1

    def __init__(self, message: str, status: int | None = None) -> None:
        super().__init__(message)
        self.status = status


class Refused(HopError):  # noqa: N818 (the name is the next step)
    """Do not retry; tell the user. The other side understood and does not want to."""

    kind = "refused"


class Unreachable(HopError):  # noqa: N818 (the name is the next step)
    """Retry later. The other side is away, slow or busy."""

    kind = "unreachable"


class Invalid(HopError):  # noqa: N818 (the name is the next step)
    """Hostile or broken data: stop and log."""

    kind = "invalid"


class Bug(HopError):  # noqa: N818 (the name is the next step)
    """The other side, or this one, has a fault of its own."""

    kind = "bug"


KINDS: dict[str, type[HopError]] = {leaf.kind: leaf for leaf in (Refused, Unreachable, Invalid, Bug)}


def from_wire(kind: str, message: str, status: int | None = None) -> HopError:
    """Return the error that the wire word names; an unknown word is a `Bug` of the sender."""
    return KINDS.get(kind, Bug)(message, status)
