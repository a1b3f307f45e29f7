"""The demo's judgement of voice_mail: the mail that has arrived, and the words of its recording."""

import asyncio
from email.message import EmailMessage
from pathlib import Path
from types import SimpleNamespace

import pytest

from rapp_cli.demo import mailbox
from rapp_cli.demo.config import VOICE_MAIL, DemoConfig
from rapp_cli.demo.voice_mail import VoiceMail
from rapp_cli.timeline import Timeline

MESSAGE = "please bring the medicine"


class Hours:
    """A clock of the event loop that a recogniser on a busy machine moves on."""

    def __init__(self) -> None:
        self.passed = 0.0


def judged(folder: Path, heard: str | None, monkeypatch: pytest.MonkeyPatch, slow: float = 0.0) -> int:
    """What `judge` gives when a mail with a recording lies there in which `heard` is heard; None: there is no mail."""
    hours = Hours()
    if heard is not None:
        mail = EmailMessage()
        mail.set_content("a voice-mail")
        mail.add_attachment(b"OggS...", maintype="audio", subtype="ogg", filename="1.ogg")
        (folder / "new").mkdir()
        (folder / "new" / "1").write_bytes(mail.as_bytes())

    def transcribe(_recording: Path) -> str:
        hours.passed += slow
        return heard or ""

    async def pause(seconds: float) -> None:
        hours.passed += seconds
        await asyncio.to_thread(int)  # the loop looks at its clock

    monkeypatch.setattr(mailbox, "transcribe", transcribe)
    config = DemoConfig(
        story=VOICE_MAIL, folder=folder, command="e-mail", recipient="Elizabeth", message=MESSAGE, voice="", robot=None,
        cloud=None, mail=None, address="", timeout=1.0, obstacle=False, silent=False,
    )  # fmt: skip

    async def story() -> int:
        loop = asyncio.get_running_loop()
        real = loop.time
        monkeypatch.setattr(loop, "time", lambda: real() + hours.passed)
        if heard is None:
            monkeypatch.setattr(mailbox.asyncio, "sleep", pause)
        system = SimpleNamespace(maildir=folder, logs=folder)
        return await VoiceMail(config, system).judge(Timeline())  # type: ignore[arg-type]

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
