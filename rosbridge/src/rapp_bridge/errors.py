"""What can go wrong in the bridge, split by what the client does next."""


class BridgeError(Exception):
    """Root of the bridge's errors; the text is what the client is told."""


class Invalid(BridgeError):  # noqa: N818 - the four names are the project's words for error kinds
    """The client's message is off: correct it."""


class Refused(BridgeError):  # noqa: N818
    """A limit or a rule of the bridge, or the called service, forbids it: do less, or ask for something else."""


class Unreachable(BridgeError):  # noqa: N818
    """The other side is not there or does not answer: try later."""


class Bug(BridgeError):  # noqa: N818
    """The bridge itself is wrong: report it."""
