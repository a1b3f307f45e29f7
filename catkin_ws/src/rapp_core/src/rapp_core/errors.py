"""What can go wrong on the robot, split by what the reader does next; `kind` is the word that crosses process borders."""


class CoreError(Exception):
    """Root of the core agent's errors; `reason` is a word for what exactly was wrong, the link's or one of those below, if any."""

    kind = "bug"
    reason = ""


class Refused(CoreError):  # noqa: N818 - the four names are the project's words for error kinds
    """A rule forbids it: do not retry, tell the person."""

    kind = "refused"


class Unreachable(CoreError):  # noqa: N818
    """The other side is not there or does not answer: try later."""

    kind = "unreachable"


class Invalid(CoreError):  # noqa: N818
    """What was given is broken or hostile: correct it."""

    kind = "invalid"


class Bug(CoreError):  # noqa: N818
    """The other side failed in a way of its own: report it."""

    kind = "bug"


KINDS: dict[str, type[CoreError]] = {error.kind: error for error in (Refused, Unreachable, Invalid, Bug)}
"""Error class of each kind."""

NO_RUNTIME = "no runtime"
"""Reason of a Refused: what a RApp is written in is not installed on this robot."""

NOT_KNOWN = "not known"
"""Reason of an Unreachable: the link was asked, and whether it has done it, or will, is not known."""
