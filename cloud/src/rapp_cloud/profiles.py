"""The user of each robot: `profiles/<robot>.json` with name, language and the contacts mail may go to (deliverable §3.3)."""

import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rapp_cloud.files import read_json, write_whole
from rapp_hop import strict_json
from rapp_hop.errors import Invalid, Refused
from rapp_hop.hz.text import check_name, check_text

MAX_BYTES = 2**20  # of one profile
MAX_CONTACTS = 1000
_ADDRESS = re.compile(r"[^\s@<>,;:\"()\\\[\]\x00-\x1f\x7f]{1,64}@[A-Za-z0-9.-]{1,255}")


@dataclass(frozen=True)
class Contact:
    """Somebody the user writes to."""

    name: str
    address: str


@dataclass(frozen=True)
class Profile:
    """A robot's user."""

    name: str
    language: str
    contacts: tuple[Contact, ...]

    def describe(self) -> dict[str, Any]:
        """Return the profile as the service gives it."""
        return {**asdict(self), "contacts": [asdict(contact) for contact in self.contacts]}


class Profiles:
    """The profiles of one platform, read when asked for."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def get(self, robot: str) -> Profile:
        """Return a robot's profile.

        :raises Refused: when there is none
        :raises Invalid: when its file is broken
        """
        path = self._folder / f"{check_name(robot)}.json"
        if not path.exists():
            raise Refused(f"cannot find a profile for {robot}: write {path.name} into the platform's profiles")
        return parse_profile(read_json(path, MAX_BYTES))

    def put(self, robot: str, profile: Profile) -> None:
        """Keep a robot's profile."""
        self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        data = strict_json.dumps(profile.describe()).encode()
        write_whole(self._folder / f"{check_name(robot)}.json", data, mode=0o600)


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
        check_text(_text(value, "language"), 16, "the profile's language"),
        tuple(_contact(item) for item in contacts),
    )


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
