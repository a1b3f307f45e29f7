"""The Maildir and the memory of what was delivered.

Rules: a message appears whole or not at all (tmp/, fsync, rename to new/, fsync of the folder). One Message-ID is
delivered once to one recipient, also after a restart and after a power cut between the message and the memory: the
message's file name and its first header tell what the memory missed. Blocking; one call at a time (a lock sees to it).
"""

import email.parser
import email.policy
import errno
import hashlib
import os
import secrets
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from rapp_cloud.mail.errors import Invalid, Refused, Unreachable

MEMORY = "delivered.log"  # beside new/ cur/ tmp/: one line "<hash of Message-ID> <hash of recipient>" per delivery
ENVELOPE = b"X-Original-To: "  # first header of every file of ours
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO)


class Postbox:
    """One Maildir for all recipients."""

    def __init__(self, maildir: Path, remembered: int) -> None:
        """Open or make the Maildir, sweep up what a crash left and remember what was delivered.

        :param remembered: deliveries kept in mind, oldest forgotten first
        :raises Unreachable: the folder cannot be used
        """
        self._maildir = maildir
        self._remembered = remembered
        self._lock = threading.Lock()
        with _translated(maildir):
            for name in ("tmp", "new", "cur"):
                (maildir / name).mkdir(parents=True, exist_ok=True, mode=0o700)
            for path in (maildir / "tmp").iterdir():
                path.unlink()
            self._delivered = self._recall()

    def deliver(self, content: bytes, sender: str, recipients: Sequence[str]) -> Path | None:
        """Store a message for those recipients who have not got it yet; None when all have.

        :param content: as sent, with CRLF line ends
        :param sender: checked envelope address, "" for none
        :param recipients: checked envelope addresses
        :return: the file in new/
        :raises Refused: malformed (bare CR or LF, NUL)
        :raises Unreachable: the disk refuses; nothing was stored
        """
        text = _unix_lines(content)
        message_id = _message_id(text)
        identity = _hash(message_id or secrets.token_hex(16))
        with self._lock, _translated(self._maildir):
            open_for = [name for name in dict.fromkeys(recipients) if (identity, _hash(name)) not in self._delivered]
            if not open_for:
                return None
            path = self._write(identity, text, sender, open_for)
            self._remember([(identity, _hash(name)) for name in open_for])
            return path

    def _write(self, identity: str, text: bytes, sender: str, recipients: Sequence[str]) -> Path:
        head = ENVELOPE + ", ".join(recipients).encode() + b"\nReturn-Path: <" + sender.encode() + b">\n"
        name = f"{time.time_ns() // 1000}.{identity}.{secrets.token_hex(4)}"
        aside = self._maildir / "tmp" / name
        try:
            with aside.open("xb") as file:
                file.write(head + text)
                file.flush()
                os.fsync(file.fileno())
            final = self._maildir / "new" / name
            aside.rename(final)
        except BaseException:
            aside.unlink(missing_ok=True)
            raise
        _sync_folder(self._maildir / "new")
        return final

    def _remember(self, entries: Sequence[tuple[str, str]]) -> None:
        self._delivered.update(dict.fromkeys(entries))
        with (self._maildir / MEMORY).open("a") as file:
            file.writelines(f"{identity} {recipient}\n" for identity, recipient in entries)
            file.flush()
            os.fsync(file.fileno())

    def _recall(self) -> dict[tuple[str, str], None]:
        found: dict[tuple[str, str], None] = {}
        with suppress(FileNotFoundError):
            for line in (self._maildir / MEMORY).read_text().splitlines():
                words = line.split()
                if len(words) == 2 and len(words[0]) == len(words[1]) == _HASH:  # not a line a power cut has torn
                    found[words[0], words[1]] = None
        found.update(dict.fromkeys(self._stored()))
        kept = dict.fromkeys(list(found)[-self._remembered :])
        aside = self._maildir / f"{MEMORY}.new"
        with aside.open("w") as file:
            file.writelines(f"{identity} {recipient}\n" for identity, recipient in kept)
            file.flush()
            os.fsync(file.fileno())
        aside.replace(self._maildir / MEMORY)
        _sync_folder(self._maildir)
        return kept

    def _stored(self) -> Iterator[tuple[str, str]]:
        for path in [*(self._maildir / "new").iterdir(), *(self._maildir / "cur").iterdir()]:
            parts = path.name.split(".")
            with path.open("rb") as file:
                line = file.readline(64 * 1024).rstrip(b"\n")
            if len(parts) >= 3 and len(parts[1]) == _HASH and line.startswith(ENVELOPE):
                for name in line.removeprefix(ENVELOPE).decode("ascii", "replace").split(", "):
                    yield parts[1], _hash(name)


_HASH = 32  # characters of a hash


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()[:_HASH]


def _unix_lines(content: bytes) -> bytes:
    text = content.replace(b"\r\n", b"\n")
    # RFC 5321 §2.3.8: CR and LF only as a pair. What passes here as one line must not be two for the next reader.
    if b"\r" in text or text.count(b"\n") != content.count(b"\r\n") or b"\0" in text:
        raise Refused("cannot take a message with bare CR, LF or NUL", "554 5.6.0 bare CR, LF or NUL in the message")
    return text


def _message_id(text: bytes) -> str | None:
    head = email.parser.BytesHeaderParser(policy=email.policy.compat32).parsebytes(text.partition(b"\n\n")[0] + b"\n\n")
    value = head.get("Message-ID")
    return "".join(str(value).split()) or None if value is not None else None


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def _translated(maildir: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            raise Unreachable(f"cannot write to {maildir}: {error.strerror}, free some space") from None
        raise Unreachable(f"cannot use {maildir}: {error.strerror}, check the folder") from None
    except UnicodeDecodeError:
        raise Invalid(f"cannot read {maildir / MEMORY}: it is not text, remove it") from None
