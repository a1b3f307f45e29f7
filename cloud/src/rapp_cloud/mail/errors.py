"""What can go wrong in the mail server, split by what the reader does next; each knows its SMTP answer (RFC 3463)."""


class MailError(Exception):
    """Root of the mail server's errors; `reply` is the SMTP answer the client gets."""

    reply = "451 4.3.0 local error, try again later"


class Refused(MailError):  # noqa: N818 (the name is the next step)
    """Do not retry: the server understood and does not want to."""

    def __init__(self, message: str, reply: str = "550 5.7.1 refused") -> None:
        super().__init__(message)
        self.reply = reply


class Unreachable(MailError):  # noqa: N818 (the name is the next step)
    """Try again later: the disk is full or the folder is away."""

    reply = "452 4.3.1 cannot store the message now, try again later"


class Invalid(MailError):  # noqa: N818 (the name is the next step)
    """A setting or a file of the server is wrong; correct it."""

    reply = "554 5.6.0 the message is malformed"


class Bug(MailError):  # noqa: N818 (the name is the next step)
    """A fault of this server."""
