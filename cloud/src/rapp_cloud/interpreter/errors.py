"""What can go wrong in interpretation, by the reader's next step; `kind` is the wire word of each."""

from typing import ClassVar


class InterpreterError(Exception):
    """Root of this package's errors."""

    kind: ClassVar[str] = "bug"


class Refused(InterpreterError):  # noqa: N818 (the name is the next step)
    """Asking again does not help: a language that is not offered."""

    kind = "refused"


class Invalid(InterpreterError):  # noqa: N818 (the name is the next step)
    """The recording is not what it must be; record again."""

    kind = "invalid"


class Bug(InterpreterError):  # noqa: N818 (the name is the next step)
    """A model is missing or not the expected one: the installation is broken."""

    kind = "bug"
