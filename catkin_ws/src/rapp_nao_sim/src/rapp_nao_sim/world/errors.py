"""What can go wrong with the world, by what the caller does next."""


class WorldError(Exception):
    """Root of the world's errors; texts begin "cannot" and say the next step."""


class Refused(WorldError):  # noqa: N818 - the four names are the project's words for error kinds
    """Asked for something that cannot be done: ask differently."""


class Invalid(WorldError):  # noqa: N818
    """A room or posture file is wrong: correct it."""


class Unreachable(WorldError):  # noqa: N818
    """The world's process is gone or silent: start the simulator again."""


class Bug(WorldError):  # noqa: N818
    """A mistake of the world's own: see its log."""
