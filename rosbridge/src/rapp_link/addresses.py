"""Mail addresses and the other short texts that go into a mail's headers. Pure.

Rule: nothing that a reader could take for the end of a line passes, so no value can begin a header of its own.
"""

import re
import unicodedata
from email.headerregistry import Address

from rapp_hop.errors import Refused

MAX_ADDRESS = 254  # characters (RFC 5321 §4.5.3.1.3, without the angle brackets)
_ATOM = r"[A-Za-z0-9!#$%&'*+/=?^_`{|}~-]+"
_LABEL = r"[A-Za-z0-9](?:[A-Za-z0-9-]{0,61}[A-Za-z0-9])?"
_LOCAL = re.compile(rf"{_ATOM}(?:\.{_ATOM})*")
_DOMAIN = re.compile(rf"{_LABEL}(?:\.{_LABEL})*")
_NAMED = re.compile(r"([^<>]*)<([^<>]*)>")
_MESSAGE_ID = re.compile(rf"<{_ATOM}(?:\.{_ATOM})*@{_ATOM}(?:\.{_ATOM})*>")
_ENDS_LINES = ("Cc", "Cs", "Zl", "Zp")  # Unicode categories: control, surrogate, line and paragraph separator


def check_address(text: str) -> str:
    """Return the address as it goes over the wire, a domain in other letters than ASCII in its IDNA form.

    :raises Refused: not a plain address (dot-atom @ host name)
    """
    local, _, domain = text.strip(" ").rpartition("@")
    try:
        domain = domain.encode("idna").decode("ascii").lower()
    except UnicodeError:
        domain = ""
    plain = f"{local}@{domain}"
    if len(plain) > MAX_ADDRESS or len(local) > 64 or not _LOCAL.fullmatch(local) or not _DOMAIN.fullmatch(domain):
        raise Refused(f"cannot mail to {_shown(text)}: give an address such as maria@home.example")
    return plain


def parse_recipient(text: str) -> Address:
    """Return the recipient spelled as `maria@home.example` or `Maria Żak <maria@home.example>`.

    :raises Refused: when it is neither
    """
    named = _NAMED.fullmatch(text.strip(" "))
    name, address = (named[1].strip(' "'), named[2]) if named else ("", text)
    return Address(display_name=check_line(name, "name of a recipient", 128), addr_spec=check_address(address))


def check_line(text: str, what: str, longest: int) -> str:
    """Return a text that is one line of at most `longest` characters.

    :raises Refused: when it is not
    """
    if len(text) > longest:
        raise Refused(f"cannot use a {what} of {len(text)} characters: at most {longest} are allowed")
    if any(unicodedata.category(letter) in _ENDS_LINES for letter in text):
        raise Refused(f"cannot use the {what} {_shown(text)}: it must be one line without control characters")
    return text


def check_message_id(text: str) -> str:
    """Return a Message-ID (RFC 5322 §3.6.4, dot-atoms only).

    :raises Refused: when it is not one
    """
    if len(text) > 250 or not _MESSAGE_ID.fullmatch(text):
        raise Refused(f"cannot use the message id {_shown(text)}: give one such as <9f1c@robot.example>")
    return text


def _shown(text: str) -> str:
    return ascii(text[:60])
