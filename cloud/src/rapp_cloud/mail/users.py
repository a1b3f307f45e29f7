"""Who may send: a JSON file of names and salted scrypt hashes (RFC 7914)."""

import hashlib
import hmac
import json
import os
import re
import secrets
from pathlib import Path

from rapp_cloud.mail.errors import Invalid, Refused

_COST, _BLOCK, _LANES = 2**13, 8, 1  # scrypt; about 20 ms each
_NAME = re.compile(r"[\x21-\x7e]{1,128}")
_NOBODY = {"salt": "00" * 16, "hash": "00" * 32}  # compared with for unknown names, so that they take as long


class Users:
    """The users of one file, as they were when it was read."""

    def __init__(self, entries: dict[str, dict[str, str]]) -> None:
        self._entries = entries

    @classmethod
    def load(cls, path: Path) -> "Users":
        """Read a users file.

        :raises Invalid: it cannot be read or is not one
        """
        try:
            entries = json.loads(path.read_text())
            checked = {str(name): {key: bytes.fromhex(entry[key]).hex() for key in _NOBODY} for name, entry in entries.items()}
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise Invalid(f"cannot read the users file {path}: {error}, make it with --add-user") from None
        return cls(checked)

    def check(self, name: str, password: str) -> bool:
        """Tell whether the password is that of the user; takes as long for a wrong name."""
        entry = self._entries.get(name, _NOBODY)
        return hmac.compare_digest(_digest(password, bytes.fromhex(entry["salt"])), entry["hash"])


def add_user(path: Path, name: str, password: str) -> None:
    """Write a user to the file (made when missing, readable by its owner only); a user of that name is replaced.

    :raises Refused: unusable name or empty password
    :raises Invalid: the file is not a users file
    """
    if not _NAME.fullmatch(name) or not password:
        raise Refused(f"cannot add {name!r}: give a name of printable ASCII and a password")
    entries = dict(Users.load(path)._entries) if path.exists() else {}
    salt = secrets.token_bytes(16)
    entries[name] = {"salt": salt.hex(), "hash": _digest(password, salt)}
    aside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    with os.fdopen(os.open(aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        json.dump(entries, file, indent=1)
        file.flush()
        os.fsync(file.fileno())
    aside.replace(path)


def _digest(password: str, salt: bytes) -> str:
    return hashlib.scrypt(password.encode(), salt=salt, n=_COST, r=_BLOCK, p=_LANES, dklen=32).hex()
