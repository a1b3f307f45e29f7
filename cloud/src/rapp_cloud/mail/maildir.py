"""Delivery into a Maildir, once per Message-ID, also over restarts."""

import email
import email.policy
import hashlib
import os
import secrets
import time
from pathlib import Path


class Maildir:
    """A folder with `new`, `cur` and `tmp`, and `seen` for the Message-IDs that were delivered.

    A mail is written aside and synchronised, then linked to its final name, which is made of its Message-ID: the second delivery
    of the same Message-ID finds the name taken.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("new", "cur", "tmp", "seen"):
            (folder / name).mkdir(parents=True, exist_ok=True)

    def deliver(self, content: bytes) -> Path | None:
        """Deliver one mail; gives its file, None when its Message-ID was delivered before. Raises OSError."""
        message_id = email.message_from_bytes(content, policy=email.policy.default)["Message-ID"]
        identity = str(message_id).strip() if message_id else secrets.token_hex(16)
        digest = hashlib.sha256(identity.encode()).hexdigest()
        aside = self.folder / "tmp" / secrets.token_hex(16)
        final = self.folder / "new" / f"{int(time.time())}.{digest[:24]}.rapp"
        with aside.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        try:
            os.link(aside, self.folder / "seen" / digest)  # fails when it is there: delivered before
            aside.replace(final)
        except FileExistsError:
            return self._again(digest, aside, final)
        return final

    def _again(self, digest: str, aside: Path, final: Path) -> Path | None:
        """A mail seen before is dropped, unless a crash came between noting it and putting it into `new`."""
        seen = self.folder / "seen" / digest
        delivered = any(self.folder.glob(f"*/*.{digest[:24]}.rapp*")) or seen.stat().st_nlink < 2
        aside.unlink()
        if delivered:
            return None
        os.link(seen, final)
        return final
