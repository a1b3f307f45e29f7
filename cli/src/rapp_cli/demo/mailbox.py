"""The mail that arrives: waits for it in the Maildir, takes out the spoken message, hears its words again."""

import asyncio
import email
import shutil
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from email.policy import default
from pathlib import Path

from rapp_cloud.interpreter.sound import read_sound
from rapp_cloud.interpreter.speech import Recogniser, model_folder

LONGEST = 60.0  # s of a recording
BEAM = 4  # texts looked at at once


@dataclass(frozen=True)
class Delivered:
    """One delivered mail: its file, and its recording saved beside the run."""

    mail: Path
    recording: Path
    recipient: str


def mails(maildir: Path) -> list[Path]:
    """The mails that lie there, oldest first."""
    return sorted(maildir.glob("**/new/*"))


async def wait_for_mail(maildir: Path, recordings: Path, old: Collection[Path] = ()) -> Delivered:
    """Wait until a mail with an audio attachment lies in the Maildir that is none of the old ones; gives the newest.

    Saves the attachment into `recordings`.
    """
    while True:
        for path in reversed([path for path in mails(maildir) if path not in old]):
            message = email.message_from_bytes(path.read_bytes(), policy=default)
            for part in message.iter_attachments():
                if part.get_content_type() in ("audio/ogg", "application/ogg"):
                    recordings.mkdir(parents=True, exist_ok=True)
                    recording = recordings / (Path(part.get_filename() or "").name or "message.ogg")
                    recording.write_bytes(part.get_content())
                    return Delivered(path, recording, str(message["To"]))
        await asyncio.sleep(0.1)


def keep_recording(runs: Path, recordings: Path) -> Path | None:
    """Copy what a run on the robot has recorded last, which goes with the run; None when there is nothing (any more)."""
    try:
        found = sorted(runs.glob("*/recordings/*.ogg"), key=lambda path: path.stat().st_mtime)
        recordings.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(found[-1], recordings)) if found else None
    except FileNotFoundError:
        return None


def words_heard(said: str, heard: str) -> Sequence[str]:
    """Those words of `said`, longer than two letters, that occur in `heard`."""
    present = set(_words(heard))
    return [word for word in _words(said) if word in present]


def _words(text: str) -> list[str]:
    return [w for w in "".join(c.lower() if c.isalnum() else " " for c in text).split() if len(w) > 2]


def transcribe(recording: Path) -> str:
    """What is said in a recording, by the platform's recogniser of free speech."""
    recogniser = Recogniser(model_folder())
    texts = recogniser.listen(read_sound(recording, LONGEST), BEAM, recogniser.expect([]), 0.0)
    return texts[0].text if texts else ""
