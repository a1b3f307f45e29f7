"""What can go wrong with the world, by what the caller does next."""


class WorldError(Exception):
    """Root of the world's errors; texts begin "cannot" and say the next step."""


class Refused(WorldError):
    """Asked for something that cannot be done: ask differently."""


class Invalid(WorldError):
    """A room or posture file is wrong: correct it."""


class Unreachable(WorldError):
    """The world's process is gone or silent: start the simulator again."""


class Bug(WorldError):
    """A mistake of the world's own: see its log."""
