"""What can go wrong in a command, split by what its reader does next."""


class CommandError(Exception):
    """A command cannot do what was asked; the text says why and the next step. Exit status 1."""


class UsageError(CommandError):
    """The command's words or values are off. Exit status 2."""
