"""Building the mail: MIME with one attachment, 7-bit on the wire. Pure."""

import hashlib
import json
import unicodedata
from dataclasses import dataclass
from datetime import datetime
from email.message import EmailMessage
from email.policy import SMTP
from email.utils import make_msgid

from rapp_hop.errors import Refused
from rapp_link.addresses import check_line, check_message_id, parse_recipient

MAX_RECIPIENTS = 20
MAX_BODY = 64 * 2**10  # characters; across rosbridge go short texts only
_SEVEN_BIT = SMTP.clone(cte_type="7bit")  # every server takes it, also one without 8BITMIME
_TYPES = {"ogg": ("audio", "ogg"), "wav": ("audio", "wav"), "png": ("image", "png"), "jpg": ("image", "jpeg")}


@dataclass(frozen=True)
class Attachment:
    """A file that goes with a mail."""

    name: str  # without folders
    data: bytes


@dataclass(frozen=True)
class Mail:
    """What the core asks to send."""

    recipients: tuple[str, ...]
    subject: str
    body: str
    message_id: str = ""  # empty: the link makes one
    attachment: Attachment | None = None

    @property
    def digest(self) -> str:
        """Tell mails with different content apart."""
        data = self.attachment.data if self.attachment else b""
        name = self.attachment.name if self.attachment else None
        words = json.dumps([self.recipients, self.subject, self.body, name, hashlib.sha256(data).hexdigest()])
        return hashlib.sha256(words.encode()).hexdigest()


@dataclass(frozen=True)
class Built:
    """A mail ready to be sent, the same bytes at every try."""

    message_id: str
    recipients: tuple[str, ...]  # envelope addresses
    content: bytes  # CRLF line ends
    digest: str


def build(mail: Mail, sender: str, now: datetime) -> Built:
    """Write the mail down.

    :param sender: checked address
    :param now: for the Date header, with time zone
    :raises Refused: a recipient, the subject, the id, the body or the file's name cannot go into a mail
    """
    if not 0 < len(mail.recipients) <= MAX_RECIPIENTS:
        raise Refused(f"cannot mail to {len(mail.recipients)} recipients: give 1 to {MAX_RECIPIENTS}")
    addresses = [parse_recipient(text) for text in mail.recipients]
    domain = sender.rpartition("@")[2]
    message = EmailMessage(policy=_SEVEN_BIT)
    message["From"] = sender
    message["To"] = addresses
    message["Subject"] = check_line(mail.subject, "subject", 500)
    message["Date"] = now
    message["Message-ID"] = check_message_id(mail.message_id or make_msgid(domain=domain))
    message.set_content(_check_body(mail.body), charset="utf-8", cte="quoted-printable")
    if mail.attachment is not None:
        _attach(message, mail.attachment)
    envelope = tuple(dict.fromkeys(address.addr_spec for address in addresses))
    return Built(str(message["Message-ID"]), envelope, message.as_bytes(), mail.digest)


def _attach(message: EmailMessage, attachment: Attachment) -> None:
    name = check_line(attachment.name, "file name", 200)
    kind, detail = _TYPES.get(name.rpartition(".")[2].lower(), ("application", "octet-stream"))
    message.add_attachment(attachment.data, maintype=kind, subtype=detail, filename=name)


def _check_body(text: str) -> str:
    if len(text) > MAX_BODY:
        raise Refused(f"cannot send a text of {len(text)} characters: at most {MAX_BODY} are allowed, attach a file")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if any(unicodedata.category(letter) in ("Cc", "Cs") and letter not in "\n\t" for letter in text):
        raise Refused("cannot send a text with control characters: leave them out")
    return text
