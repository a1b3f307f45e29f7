"""What can go wrong in the link, split by what the reader does next; `kind` is the word that crosses process borders."""


class LinkError(Exception):
    """Root of the link's errors."""

    kind = "bug"


class Refused(LinkError):  # noqa: N818 - the four names are the project's words for error kinds
    """The other side understood and does not want to: do not retry."""

    kind = "refused"


class Unreachable(LinkError):  # noqa: N818
    """The other side is away: try later."""

    kind = "unreachable"


class Invalid(LinkError):  # noqa: N818
    """What was given is broken: correct it."""

    kind = "invalid"
