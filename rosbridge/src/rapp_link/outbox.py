"""The mails on the disk. Rules:

a mail is in the outbox whole or not at all (its folder is made aside, then renamed); the same bytes and one Message-ID go
out at every try; what the server took is written down before anybody is told; the content of a finished mail goes, its
Message-ID stays, so that asking twice sends once; one refused or given up after it was kept keeps its content. A power
cut between the server's "taken" and our note means one more try with the same Message-ID, which a server that knows it
drops.

Layout: <folder>/<hash of Message-ID>/{letter.json, message.eml}. Blocking; one thread at a time (a lock sees to it).
"""

import errno
import hashlib
import logging
import threading
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from rapp_hop.errors import Invalid, Refused
from rapp_link.disk import Disk, new_aside, replace_whole, sweep
from rapp_link.letter import Letter, from_json, to_json
from rapp_link.message import Built

_log = logging.getLogger(__name__)
REMEMBERED = 1000  # finished mails whose Message-ID is known
UNDELIVERED = 20  # of them whose content stays, as it was refused after the mail had been kept


class Outbox:
    """All mails of this robot: those that wait and the ids of those that are done."""

    def __init__(self, folder: Path, waiting: int, disk: Disk | None = None) -> None:
        """Open or make the outbox and set right what a power cut left.

        :param waiting: mails that may wait at once
        :raises Refused: the disk refuses
        """
        self._folder = folder
        self._waiting = waiting
        self._disk = disk or Disk()
        self._lock = threading.Lock()
        self._letters: dict[str, Letter] = {}
        with _translated(folder):
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._reconcile()

    def queued(self) -> list[Letter]:
        """Return the mails that wait, oldest first."""
        with self._lock:
            waiting = [letter for letter in self._letters.values() if letter.state == "queued"]
        return sorted(waiting, key=lambda letter: letter.queued_at)

    def find(self, message_id: str) -> Letter | None:
        """Return what is known of a mail."""
        with self._lock:
            return self._letters.get(message_id)

    def put(self, built: Built, sender: str, now: float) -> Letter:
        """Keep a mail; one that is known already is not kept again, its letter tells how far it is.

        :param now: seconds since 1970
        :raises Refused: the id belongs to another mail, the outbox is full, or the disk refuses
        """
        with self._lock, _translated(self._folder):
            known = self._letters.get(built.message_id)
            if known is not None:
                if known.digest != built.digest:
                    raise Refused(f"cannot send two mails as {built.message_id}: give the second an id of its own")
                return known
            if sum(letter.state == "queued" for letter in self._letters.values()) >= self._waiting:
                raise Refused(f"cannot keep more than {self._waiting} mails: see why the mail server takes none")
            letter = Letter(built.message_id, sender, built.recipients, built.digest, now, built.recipients)
            self._store(letter, built.content)
            self._letters[letter.message_id] = letter
            return letter

    def content(self, letter: Letter) -> bytes:
        """Return the bytes to send.

        :raises Refused: the disk refuses
        """
        with _translated(self._folder):
            return (self._place(letter) / "message.eml").read_bytes()

    def update(self, letter: Letter) -> None:
        """Write down how far a mail is; in memory it is known even when the disk refuses.

        :raises Refused: the disk refuses
        """
        with self._lock, _translated(self._folder):
            self._note(letter)

    def untold(self) -> Letter | None:
        """Return the oldest mail refused after it was kept of which nobody has been told; does not wait for the disk."""
        letters = [letter for letter in list(self._letters.values()) if letter.untold]  # list: whole in one step, so no lock
        return min(letters, key=lambda letter: letter.queued_at, default=None)

    def told(self, message_id: str, recipients: Collection[str], *, late: bool) -> None:
        """Write down that a mail's refusal has been told; in memory it is known even when the disk refuses.

        :param recipients: of whom was told; those who are not refused do not count
        :param late: aloud, after the mail had been kept; otherwise to who asked for it, and its content goes
        :raises Refused: the disk refuses
        """
        with self._lock, _translated(self._folder):
            letter = self._letters.get(message_id)
            names = tuple(name for name in letter.untold if name in recipients) if letter is not None else ()
            if letter is not None and names:
                self._note(replace(letter, late=letter.late + names) if late else replace(letter, told=letter.told + names))

    def _note(self, letter: Letter) -> None:
        self._letters[letter.message_id] = letter
        replace_whole(self._disk, self._place(letter) / "letter.json", to_json(letter))
        if letter.state != "queued":
            if not letter.undelivered:
                self._disk.remove(self._place(letter) / "message.eml")
            self._forget_oldest()

    def _store(self, letter: Letter, content: bytes) -> None:
        aside = new_aside(self._folder)
        try:
            self._disk.make_folder(aside)
            self._disk.write(aside / "message.eml", content)
            self._disk.write(aside / "letter.json", to_json(letter))
            self._disk.rename(aside, self._place(letter))
        except OSError:
            for path in (aside, self._place(letter)):  # in its place it is when only that could not be brought to the disk
                self._disk.remove(path)
            raise

    def _reconcile(self) -> None:
        sweep(self._disk, self._folder)
        for place in sorted(path for path in self._folder.iterdir() if path.is_dir()):
            sweep(self._disk, place)
            try:
                letter = from_json((place / "letter.json").read_bytes())
            except (Invalid, FileNotFoundError) as error:
                _log.error("cannot use %s: %s, look at it and remove it", place, error)
                continue
            self._letters[letter.message_id] = letter
            if letter.state != "queued" and not letter.undelivered:
                self._disk.remove(place / "message.eml")
        self._forget_oldest()

    def _forget_oldest(self) -> None:
        done = sorted((item for item in self._letters.values() if item.state != "queued"), key=lambda item: item.queued_at)
        for letter in done[: max(0, len(done) - REMEMBERED)]:
            self._disk.remove(self._place(letter))
            del self._letters[letter.message_id]
        for letter in [item for item in done if item.undelivered][:-UNDELIVERED]:
            self._disk.remove(self._place(letter) / "message.eml")

    def _place(self, letter: Letter) -> Path:
        return self._folder / hashlib.sha256(letter.message_id.encode()).hexdigest()[:40]


@contextmanager
def _translated(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        step = "free some space" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "check the folder"
        raise Refused(f"cannot keep mails: {error.strerror}, {step} ({folder})") from None
