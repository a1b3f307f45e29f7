"""Builds the mail of a request: MIME with an audio attachment. Pure but for reading the attachment."""

from collections.abc import Mapping
from dataclasses import dataclass
from email.headerregistry import Address
from email.message import EmailMessage
from email.policy import SMTP
from email.utils import formatdate
from pathlib import Path
from typing import Any

from rapp_link.errors import Invalid, Refused

LARGEST = 24 << 20  # bytes of an attachment
MOST = 20  # recipients


@dataclass(frozen=True)
class MailRequest:
    """What a dynamic agent wants sent."""

    recipients: tuple[str, ...]
    subject: str
    body: str
    attachment: Path | None
    message_id: str


def request(arguments: Mapping[str, Any], home: Path) -> MailRequest:
    """Check the arguments of rapp_hop/send_mail. Raises Invalid, Refused for a file outside the robot's data."""
    recipients = arguments.get("recipients")
    texts = [arguments.get(name) for name in ("subject", "body", "message_id")]
    if not isinstance(recipients, list) or not 1 <= len(recipients) <= MOST or not all(isinstance(t, str) for t in texts):
        raise Invalid(f"cannot send: 1 to {MOST} recipients, subject, body and message_id are needed")
    subject, body, message_id = (str(text) for text in texts)
    for header in (subject, message_id, *map(str, recipients)):
        if any(ord(c) < 32 or ord(c) == 127 for c in header):
            raise Invalid("cannot send: recipients, subject and message_id must be one line each")
    for recipient in recipients:
        _check_address(recipient)
    return MailRequest(tuple(recipients), subject, body, _attachment(arguments.get("attachment"), home), message_id)


def _check_address(text: object) -> None:
    try:
        address = Address(addr_spec=str(text))
    except (ValueError, IndexError) as error:
        raise Invalid(f"cannot send to {text!r}: that is no mail address") from error
    if not address.username or not address.domain:
        raise Invalid(f"cannot send to {text!r}: that is no mail address")


def _attachment(value: object, home: Path) -> Path | None:
    if not value:
        return None
    path = Path(str(value)).resolve()
    if not path.is_relative_to(home):
        raise Refused(f"cannot attach {path}: only the robot's own data may leave it")
    if not path.is_file() or path.stat().st_size > LARGEST:
        raise Invalid(f"cannot attach {path}: a file of at most {LARGEST} bytes is needed")
    return path


def build(mail: MailRequest, sender: str) -> bytes:
    """The mail as it travels (RFC 5322)."""
    message = EmailMessage(policy=SMTP)
    message["From"] = sender or "robot@localhost"
    message["To"] = ", ".join(mail.recipients)
    message["Subject"] = mail.subject
    message["Date"] = formatdate(localtime=True)
    message["Message-ID"] = mail.message_id
    message.set_content(mail.body)
    if mail.attachment is not None:
        content = mail.attachment.read_bytes()
        message.add_attachment(content, maintype="audio", subtype="ogg", filename="message.ogg")
    return message.as_bytes()
