"""What can go wrong for a RApp, split by what its author does next."""


class RappError(Exception):
    """Root of the errors of this package."""


class Refused(RappError):  # noqa: N818 - the four names are the project's words for error kinds
    """A rule forbids it (permission, lease, limit): do not retry."""


class Unreachable(RappError):  # noqa: N818
    """Core agent, robot or cloud do not answer: try later, or tell the person."""


class Invalid(RappError):  # noqa: N818
    """What was given is off: correct the call."""


class Bug(RappError):  # noqa: N818
    """The other side failed in a way of its own: report it."""


KINDS: dict[str, type[RappError]] = {"refused": Refused, "unreachable": Unreachable, "invalid": Invalid, "bug": Bug}
"""Error class of each word that comes from the core agent."""
