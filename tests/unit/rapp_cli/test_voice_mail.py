"""The demo's judgement of voice_mail: the mail that has arrived, and the words of its recording."""

import asyncio
import os
import shutil
from collections.abc import Sequence
from email.message import EmailMessage
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rapp_cli.demo import mailbox
from rapp_cli.demo.config import VOICE_MAIL, DemoConfig
from rapp_cli.demo.story import Reply
from rapp_cli.demo.voice_mail import VoiceMail
from rapp_cli.mail_account import MailAccount
from rapp_cli.person import Person
from rapp_cli.timeline import Entry, Timeline

MESSAGE = "please bring the medicine"
ADDRESS = "elizabeth@home.example"
ACCOUNT = MailAccount("smtp.example.org", 587, "", "starttls", None, "")
DELIVERED = Entry("core", "core", "s9", "message", "link->core reply send_mail: delivered")


class Hours:
    """A clock of the event loop that a recogniser on a busy machine moves on."""

    def __init__(self) -> None:
        self.passed = 0.0


def config(folder: Path, **wishes: Any) -> DemoConfig:
    usual: dict[str, Any] = {"robot": None, "cloud": None, "mail": None, "address": ADDRESS}
    return DemoConfig(
        story=VOICE_MAIL, folder=folder, command="e-mail", recipient="Elizabeth", message=MESSAGE, voice="", timeout=1.0,
        obstacle=False, silent=False, **{**usual, **wishes},
    )  # fmt: skip


def put_mail(folder: Path, name: str, recipient: str = ADDRESS) -> None:
    mail = EmailMessage()
    mail["To"] = recipient
    mail.set_content("a voice-mail")
    mail.add_attachment(b"OggS...", maintype="audio", subtype="ogg", filename="1.ogg")
    (folder / "new").mkdir(exist_ok=True)
    (folder / "new" / name).write_bytes(mail.as_bytes())


def system(folder: Path) -> Any:
    return SimpleNamespace(maildir=folder, logs=folder)


def judged(
    folder: Path, heard: str | None, monkeypatch: pytest.MonkeyPatch, slow: float = 0.0, to: str = ADDRESS, **wishes: Any
) -> int:
    """What `judge` gives when a mail with a recording comes in which `heard` is heard; None: there is only an older mail."""
    hours = Hours()
    put_mail(folder, "1", "somebody@home.example")

    def transcribe(_recording: Path) -> str:
        hours.passed += slow
        return heard or ""

    async def pause(seconds: float) -> None:
        hours.passed += seconds
        await asyncio.to_thread(int)  # the loop looks at its clock

    monkeypatch.setattr(mailbox, "transcribe", transcribe)

    async def story() -> int:
        loop = asyncio.get_running_loop()
        real = loop.time
        monkeypatch.setattr(loop, "time", lambda: real() + hours.passed)
        told = VoiceMail(config(folder, **wishes), system(folder))
        if heard is None:
            monkeypatch.setattr(mailbox.asyncio, "sleep", pause)
        else:
            put_mail(folder, "0", to)
        return await told.judge(Timeline())

    return asyncio.run(story())


def test_a_mail_is_judged_by_its_words_however_long_hearing_them_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert judged(tmp_path, "Please bring the medicine.", monkeypatch, slow=3600.0) == 0
    assert "4 of 4 words heard again" in capsys.readouterr().out


def test_a_mail_without_the_message_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert judged(tmp_path, "what", monkeypatch) == 1
    assert "does not hold the spoken message" in capsys.readouterr().err


def test_no_mail_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert judged(tmp_path, None, monkeypatch) == 1
    assert "no mail arrived" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("wishes", "status"),
    [({}, 1), ({"address": ""}, 0), ({"robot": "tcp://nao.local:9559"}, 0)],
    ids=["own platform", "a platform that knows the address", "somebody else speaks"],
)
def test_a_mail_to_another_recipient_is_wrong(
    wishes: dict[str, Any], status: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert judged(tmp_path, MESSAGE, monkeypatch, to="margaret@home.example", **wishes) == status
    assert ("not to elizabeth@home.example" in capsys.readouterr().err) == bool(status)


def test_what_was_said_to_a_real_robot_is_not_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert judged(tmp_path, "what", monkeypatch, robot="tcp://nao.local:9559") == 0
    assert "is not judged" in capsys.readouterr().out


async def told_by(timeline: Timeline, entries: Sequence[Entry]) -> None:
    for entry in entries:
        await timeline.add(entry)


def accepted(folder: Path, recorded: bool, entries: Sequence[Entry], monkeypatch: pytest.MonkeyPatch, **wishes: Any) -> int:
    """What `judge` gives for a real mail account after the robot has said that it sends what it has recorded, if it has."""
    heard = {"new.ogg": MESSAGE, "old.ogg": "what"}
    monkeypatch.setattr(mailbox, "transcribe", lambda recording: heard[recording.name])
    recordings = folder / "robot" / "runs" / "cafe" / "recordings"
    recordings.mkdir(parents=True)
    for age, name in enumerate(heard if recorded else ()):
        (recordings / name).write_bytes(b"OggS...")
        os.utime(recordings / name, (1e9 - age, 1e9 - age))

    async def converse(_person: Person, _command: str, _timeline: Timeline, reply: Reply) -> None:
        assert reply("sending e-mail") is None
        shutil.rmtree(folder / "robot")  # the run has ended

    monkeypatch.setattr("rapp_cli.demo.voice_mail.converse", converse)

    async def story() -> int:
        timeline, told = Timeline(), VoiceMail(config(folder, mail=ACCOUNT, **wishes), system(folder))
        await told_by(timeline, entries)
        if "robot" not in wishes:
            await told.live(None, timeline)  # type: ignore[arg-type]
        return await told.judge(timeline)

    return asyncio.run(story())


HEARD = [Entry("core", "core", "s9", "heard", word) for word in ("e-mail", "Elizabeth", "Margaret")]


@pytest.mark.parametrize(
    ("recorded", "entries", "wishes", "status", "words"),
    [
        (True, [*HEARD[:2], DELIVERED], {}, 0, "4 of 4 words"),
        (True, HEARD[:2], {}, 1, "has not accepted a mail"),
        (True, [HEARD[0], HEARD[2], DELIVERED], {}, 1, "heard e-mail and Margaret"),
        (False, [*HEARD[:2], DELIVERED], {}, 1, "could not be judged"),
        (False, [*HEARD, DELIVERED], {"robot": "tcp://nao.local:9559"}, 0, "is not judged"),
    ],
)
def test_a_real_mail_accounts_mail_is_judged_by_the_recording_on_the_robot(
    recorded: bool, entries: Sequence[Entry], wishes: dict[str, Any], status: int, words: str,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert accepted(tmp_path, recorded, entries, monkeypatch, **wishes) == status
    output = capsys.readouterr()
    assert words in output.out + output.err
