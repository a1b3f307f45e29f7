"""Finding the delivered mail and its words."""

import asyncio
from email.message import EmailMessage
from pathlib import Path

from rapp_cli.demo.mailbox import wait_for_mail, words_heard


def test_words_are_compared_without_case_and_punctuation() -> None:
    assert words_heard("Bring the water, please!", "they bring water") == ["bring", "water"]
    assert words_heard("Bring the water", "") == []


def test_the_attachment_of_a_delivered_mail_is_saved(tmp_path: Path) -> None:
    mail = EmailMessage()
    mail["To"] = "a@home.example"
    mail.set_content("a voice-mail")
    mail.add_attachment(b"OggS...", maintype="audio", subtype="ogg", filename="../../evil.ogg")
    (tmp_path / "box" / "new").mkdir(parents=True)
    (tmp_path / "box" / "new" / "1").write_bytes(mail.as_bytes())
    delivered = asyncio.run(wait_for_mail(tmp_path / "box", tmp_path / "received"))
    assert delivered.recording == tmp_path / "received" / "evil.ogg"
    assert delivered.recording.read_bytes() == b"OggS..."
    assert delivered.recipient == "a@home.example"
