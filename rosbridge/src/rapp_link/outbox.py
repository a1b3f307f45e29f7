"""Mails on disk until the server has them: written before the first try, removed after acceptance, one Message-ID over all tries.

A folder per mail, named by the digest of its Message-ID: `mail` holds the whole mail, `envelope.json` its recipients and, once
the server has accepted it, the state "sent". A crash between acceptance and the note sends the mail again with the same
Message-ID; our own server delivers that once.
"""

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rapp_link.errors import Refused, Unreachable

Send = Callable[[Sequence[str], bytes], None]


@dataclass(frozen=True)
class Kept:
    """One mail in the outbox."""

    folder: Path
    message_id: str
    recipients: tuple[str, ...]
    state: str  # queued, sent, refused
    reason: str = ""


class Outbox:
    """The folder of mails; used by one thread at a time."""

    def __init__(self, folder: Path, send: Send) -> None:
        self._folder = folder
        self._send = send
        folder.mkdir(parents=True, exist_ok=True)
        for aside in folder.glob("*.new"):
            shutil.rmtree(aside)

    def put(self, message_id: str, recipients: Sequence[str], content: bytes) -> Kept:
        """Keep a mail on disk; the same Message-ID again gives what is known of it."""
        name = hashlib.sha256(message_id.encode()).hexdigest()[:32]
        final = self._folder / name
        if final.exists():
            return self._read(final)
        aside = self._folder / f"{name}.new"
        aside.mkdir()
        _write(aside / "mail", content)
        self._note(aside, Kept(aside, message_id, tuple(recipients), "queued"))
        aside.rename(final)
        _sync(self._folder)
        return self._read(final)

    def queued(self) -> list[Kept]:
        """Mails that still have to be sent, oldest first."""
        folders = sorted((f for f in self._folder.iterdir() if not f.name.endswith(".new")), key=lambda f: f.stat().st_mtime)
        return [kept for kept in map(self._read, folders) if kept.state == "queued"]

    def deliver(self, kept: Kept) -> None:
        """Try to send one mail. Raises Unreachable: it stays queued; Refused: it is noted as refused and not tried again."""
        if kept.state == "sent":
            return
        try:
            self._send(kept.recipients, (kept.folder / "mail").read_bytes())
        except Refused as error:
            self._note(kept.folder, Kept(kept.folder, kept.message_id, kept.recipients, "refused", str(error)))
            raise
        self._note(kept.folder, Kept(kept.folder, kept.message_id, kept.recipients, "sent"))
        (kept.folder / "mail").unlink()

    def deliver_all(self) -> int:
        """Try all queued mails; gives how many are still queued."""
        left = 0
        for kept in self.queued():
            try:
                self.deliver(kept)
            except Unreachable:
                left += 1
            except Refused:
                continue  # noted in its envelope
        return left

    @staticmethod
    def _read(folder: Path) -> Kept:
        values = json.loads((folder / "envelope.json").read_text())
        return Kept(folder, values["message_id"], tuple(values["recipients"]), values["state"], values["reason"])

    @staticmethod
    def _note(folder: Path, kept: Kept) -> None:
        values = {"message_id": kept.message_id, "recipients": kept.recipients, "state": kept.state, "reason": kept.reason}
        aside = folder / "envelope.json.new"
        _write(aside, json.dumps(values).encode())
        aside.replace(folder / "envelope.json")
        _sync(folder)


def _write(path: Path, content: bytes) -> None:
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _sync(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
