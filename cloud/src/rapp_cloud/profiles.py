"""What is known of a person: name, language and the contacts mail may go to (deliverable §3.3). Pure."""

import re
from dataclasses import asdict, dataclass
from typing import Any

from rapp_hop.errors import Invalid
from rapp_hop.hz.text import check_language, check_text

MAX_BYTES = 2**20  # of one profile
MAX_CONTACTS = 100  # as many words as a robot listens for at once
_ADDRESS = re.compile(r"[^\s@<>,;:\"()\\\[\]\x00-\x1f\x7f]{1,64}@[A-Za-z0-9.-]{1,255}")


@dataclass(frozen=True)
class Contact:
    """Somebody the person writes to."""

    name: str
    address: str


@dataclass(frozen=True)
class Profile:
    """One person's."""

    name: str
    language: str
    contacts: tuple[Contact, ...]

    def describe(self) -> dict[str, Any]:
        """Return the profile as the service gives it."""
        return {**asdict(self), "contacts": [asdict(contact) for contact in self.contacts]}


def parse_profile(value: Any) -> Profile:
    """Return the profile a JSON value spells.

    :raises Invalid: naming what is wrong, an address that could smuggle a mail header too (H19)
    """
    if not isinstance(value, dict) or not isinstance(value.get("contacts", []), list):
        raise Invalid("cannot read the profile: write name, language and a list of contacts")
    contacts = value.get("contacts", [])
    if len(contacts) > MAX_CONTACTS:
        raise Invalid(f"cannot read the profile: more than {MAX_CONTACTS} contacts")
    return Profile(
        check_text(_text(value, "name"), 100, "the profile's name"),
        check_language(_text(value, "language"), "the profile"),
        _apart([_contact(item) for item in contacts]),
    )


def sound_of(name: str) -> str:
    """What is heard of a written name: its letters and digits; "" when nobody can say it."""
    return "".join(sign for sign in name.casefold() if sign.isalnum())


def _apart(contacts: list[Contact]) -> tuple[Contact, ...]:
    """The contacts, which a robot has to tell from each other by ear."""
    heard: dict[str, str] = {}
    for contact in contacts:
        sound = sound_of(contact.name)
        if not sound:
            raise Invalid(f"cannot read the profile: nobody can say {contact.name!r}; give the contact a name with letters")
        if sound in heard:
            raise Invalid(f"cannot read the profile: {contact.name!r} sounds like {heard[sound]!r}; give one another name")
        heard[sound] = contact.name
    return tuple(contacts)


def _contact(value: Any) -> Contact:
    if not isinstance(value, dict):
        raise Invalid("cannot read the profile: a contact must be an object with name and address")
    name, address = check_text(_text(value, "name"), 100, "a contact's name"), _text(value, "address")
    if not _ADDRESS.fullmatch(address):
        raise Invalid(f"cannot read the profile: {address[:80]!r} is not a mail address")
    return Contact(name, address)


def _text(value: dict[str, Any], key: str) -> str:
    found = value.get(key)
    if not isinstance(found, str):
        raise Invalid(f"cannot read the profile: {key} must be a text")
    return found
