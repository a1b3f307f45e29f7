"""The power goes, or the disk refuses, at every call of the outbox's disk: a mail is there whole or not at all, and comes once."""

import email
import errno
import os
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest

from rapp_hop.errors import Refused
from rapp_link.disk import ASIDE, Disk
from rapp_link.letter import Outcome
from rapp_link.message import Mail, build
from rapp_link.outbox import Outbox

ME, ANNA, IDENTITY = "nao@home.example", "anna@home.example", "<1@nao>"
MAIL = build(Mail((ANNA,), "subject", "body", IDENTITY), ME, datetime.now(UTC))


class PowerGoneError(BaseException):
    """Nothing happens after this."""


class CutDisk(Disk):
    """Works for so many calls; then the power is gone, what was being written is torn, or what takes space is refused."""

    def __init__(self, how: str, works: int) -> None:
        self.calls: list[str] = []
        self._how, self._works = how, works

    def write(self, path: Path, data: bytes) -> None:
        """See `Disk`."""
        self._call("write", lambda: super(CutDisk, self).write(path, data[: len(data) // 2]))
        super().write(path, data)

    def make_folder(self, path: Path) -> None:
        """See `Disk`."""
        self._call("make_folder")
        super().make_folder(path)

    def rename(self, source: Path, target: Path) -> None:
        """See `Disk`."""
        self._call("rename")
        super().rename(source, target)

    def remove(self, path: Path) -> None:
        """See `Disk`."""
        self._call("remove")
        super().remove(path)

    def sync_folder(self, path: Path) -> None:
        """See `Disk`; the second one of a rename comes when that has happened."""
        self._call("sync_folder")
        super().sync_folder(path)

    def _call(self, name: str, torn: Callable[[], None] = lambda: None) -> None:
        self.calls.append(name)
        if len(self.calls) <= self._works:
            return
        if self._how == "full" and name == "remove":
            return
        if self._how != "killed":
            torn()
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)) if self._how == "full" else PowerGoneError


class Server:
    """Says "later" to the first try, then takes the mail, or refuses it."""

    def __init__(self, takes: bool) -> None:
        self.taken: list[bytes] = []
        self.answered = 0
        self._takes = takes

    def answer(self, content: bytes) -> Outcome:
        """One try."""
        self.answered += 1
        if self.answered == 1:
            return Outcome(later={ANNA: "451"})
        if not self._takes:
            return Outcome(refused={ANNA: "550"})
        self.taken.append(content)
        return Outcome(accepted=(ANNA,))


def story(outbox: Outbox, server: Server) -> None:
    """What the link does with a mail; the core agent asks again after the link was away."""
    letter = outbox.put(MAIL, ME, 0.0)
    while letter.state == "queued":
        letter = letter.after(server.answer(outbox.content(letter)))
        outbox.update(letter)
    outbox.told(IDENTITY, (ANNA,), late=True)


def unfinished(folder: Path) -> list[Path]:
    """What was made aside and is not in its place."""
    return [path for path in folder.rglob("*") if path.name.startswith(ASIDE)]


def after_a_cut(folder: Path, server: Server) -> str:
    """Begin again: there is the mail, whole, or nothing, and nothing unfinished; gives how far it is."""
    outbox = Outbox(folder, 5)
    assert unfinished(folder) == []
    letter = outbox.find(IDENTITY)
    if letter is None:
        assert list(folder.iterdir()) == []
        return "nothing"
    kept = [path.read_bytes() for path in folder.rglob("message.eml")]
    assert kept == ([] if letter.state == "sent" else [MAIL.content])
    assert letter.state == "queued" or server.answered > 1
    return letter.state


@pytest.mark.parametrize("how", ["killed", "torn", "full"])
@pytest.mark.parametrize(("takes", "end"), [(True, "sent"), (False, "refused")], ids=["taken", "refused later"])
def test_every_call(tmp_path: Path, how: str, takes: bool, end: str) -> None:
    found: list[str] = []
    while True:
        folder, disk, server = tmp_path / str(len(found)), CutDisk(how, len(found)), Server(takes)
        refused = False
        try:
            story(Outbox(folder, 5, disk), server)
        except PowerGoneError:
            pass
        except Refused:
            refused = True
            assert unfinished(folder) == [], "they would take space until the next start"
        found.append(after_a_cut(folder, server))
        if refused and not server.answered:
            assert found[-1] == "nothing", "who was refused must not hear that it was sent all the same"
        told = server.answered
        story(Outbox(folder, 5), server)
        assert after_a_cut(folder, server) == end
        assert found[-1] != end or server.answered == told, "what is over is not tried again"
        assert {email.message_from_bytes(content)["Message-ID"] for content in server.taken} == ({IDENTITY} if takes else set())
        assert set(server.taken) <= {MAIL.content}
        assert Outbox(folder, 5).untold() is None
        if len(disk.calls) < len(found):
            break
    print(len(found), "calls")
    assert {"nothing", "queued", end} == set(found)
    assert found == sorted(found, key=["nothing", "queued", end].index)
