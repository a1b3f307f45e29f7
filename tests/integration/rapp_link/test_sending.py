"""Outbox, postman and smtplib against the real mail server: STARTTLS, AUTH, refusals, a server that is away."""

import asyncio
import socket
import threading
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import pytest

from rapp_hop.errors import Invalid, Unreachable
from rapp_link.config import MailConfig
from rapp_link.letter import Letter
from rapp_link.message import Attachment, Mail, build
from rapp_link.outbox import Outbox
from rapp_link.postman import Postman
from rapp_link.smtp import Locked, SmtpSender

PASSWORD = "correct horse: battery"
SENDER = "nao@home.example"
T = TypeVar("T")


def account(port: int, **changes: Any) -> MailConfig:
    plain = MailConfig(host="127.0.0.1", port=port, security="none", sender=SENDER, retry_first=0.05, retry_most=0.2)
    return replace(plain, **changes)


def mail(message_id: str, *recipients: str) -> Mail:
    recording = Attachment("message.ogg", b"OggS" + bytes(range(256)) * 40)
    return Mail(recipients or ("zofia@home.example",), "voice message", "Please listen.", message_id, recording)


def put(outbox: Outbox, wish: Mail) -> Letter:
    now = datetime.now(UTC)
    return outbox.put(build(wish, SENDER, now), SENDER, now.timestamp())


async def working(config: MailConfig, outbox: Outbox, story: Callable[[Postman], Awaitable[T]]) -> T:
    """Run a story beside a postman at work."""
    postman = Postman(outbox, SmtpSender(config), config)
    work = asyncio.create_task(postman.run())
    try:
        return await story(postman)
    finally:
        work.cancel()


def sent(config: MailConfig, outbox: Outbox, wish: Mail) -> Letter:
    async def story(postman: Postman) -> Letter:
        return await postman.deliver(put(outbox, wish), 20)

    return asyncio.run(working(config, outbox, story))


def arrived(tmp_path: Path) -> list[bytes]:
    return [path.read_bytes() for path in (tmp_path / "mail" / "new").iterdir()]


@pytest.fixture
def outbox(tmp_path: Path) -> Outbox:
    return Outbox(tmp_path / "outbox", 20)


@pytest.fixture
def guarded(start_mail: Any, certificate: Any, users_file: Path) -> Any:
    words = ["--cert", str(certificate.certificate), "--key", str(certificate.key), "--users-file", str(users_file)]
    return start_mail(*words)


def test_a_mail_goes_by_starttls_and_login(guarded: Any, certificate: Any, outbox: Outbox, tmp_path: Path) -> None:
    config = account(guarded.ready["port"], security="starttls", ca_file=certificate.certificate, user="nao", password=PASSWORD)
    letter = sent(config, outbox, mail("<1@nao>"))
    assert (letter.state, letter.tries) == ("sent", 1)
    (message,) = arrived(tmp_path)
    assert b"Message-ID: <1@nao>\n" in message
    assert PASSWORD not in (tmp_path / "rapp_cloud.mail.log").read_text()


@pytest.mark.parametrize("login", [{"user": "nao", "password": "x"}, {}], ids=["wrong password", "no login"])
def test_a_mail_waits_until_the_account_is_mended(
    guarded: Any, certificate: Any, outbox: Outbox, tmp_path: Path, login: dict[str, str]
) -> None:
    config = account(guarded.ready["port"], security="starttls", ca_file=certificate.certificate, **login)
    letter = sent(config, outbox, mail("<1@nao>"))
    assert (letter.state, letter.locked) == ("queued", True)
    assert arrived(tmp_path) == []
    mended = replace(config, user="nao", password=PASSWORD)
    assert sent(mended, Outbox(tmp_path / "outbox", 20), mail("<1@nao>")).state == "sent"
    assert len(arrived(tmp_path)) == 1


def test_a_wrong_password_is_told_in_the_servers_words(guarded: Any, certificate: Any) -> None:
    config = account(guarded.ready["port"], security="starttls", ca_file=certificate.certificate, user="nao", password="x")
    with pytest.raises(Locked, match="535"):
        send_bare(config)


def test_a_server_without_login_locks_the_account_out(start_mail: Any) -> None:
    with pytest.raises(Locked, match="AUTH"):
        send_bare(account(start_mail().ready["port"], user="nao", password=PASSWORD))


def send_bare(config: MailConfig) -> None:
    asyncio.run(SmtpSender(config).send(SENDER, ["zofia@home.example"], b"Subject: hello\r\n\r\nhello\r\n"))


def test_a_certificate_that_does_not_fit_is_not_believed(
    start_mail: Any, certificate: Any, foreign_certificate: Any, tmp_path: Path
) -> None:
    ours = start_mail("--cert", str(certificate.certificate), "--key", str(certificate.key)).ready["port"]
    with pytest.raises(Invalid, match="cannot trust"):  # nobody vouches for it
        send_bare(account(ours, security="starttls"))
    theirs = start_mail("--cert", str(foreign_certificate.certificate), "--key", str(foreign_certificate.key)).ready["port"]
    with pytest.raises(Invalid, match="cannot trust"):  # vouched for, for another address
        send_bare(account(theirs, security="starttls", ca_file=foreign_certificate.certificate))
    assert arrived(tmp_path) == []


def test_encryption_asked_for_is_never_given_up(start_mail: Any, outbox: Outbox, tmp_path: Path) -> None:
    letter = sent(account(start_mail().ready["port"], security="starttls"), outbox, mail("<1@nao>"))
    assert letter.state == "queued"
    assert arrived(tmp_path) == []


def test_while_the_server_is_away_a_mail_is_kept_and_then_delivered_once(start_mail: Any, outbox: Outbox, tmp_path: Path) -> None:
    server = start_mail()
    port = server.ready["port"]
    server.stop()
    config = account(port)

    async def story(postman: Postman) -> tuple[Letter, Letter | None]:
        kept = await postman.deliver(put(outbox, mail("<1@nao>")), 20)
        await asyncio.to_thread(start_mail, port=port)
        async with asyncio.timeout(20):
            while outbox.queued():
                await asyncio.sleep(0.02)
        return kept, outbox.find("<1@nao>")

    kept, later = asyncio.run(working(config, outbox, story))
    assert kept.state == "queued"
    assert later is not None
    assert later.state == "sent"
    assert len(arrived(tmp_path)) == 1
    assert sent(config, outbox, mail("<1@nao>")).tries == later.tries, "asked again it is not sent again"


def test_what_an_earlier_process_left_goes_out_by_itself(start_mail: Any, outbox: Outbox, tmp_path: Path) -> None:
    put(outbox, mail("<1@nao>"))
    port = start_mail().ready["port"]
    later = Outbox(tmp_path / "outbox", 20)

    async def story(_postman: Postman) -> None:
        async with asyncio.timeout(20):
            while later.queued():
                await asyncio.sleep(0.02)

    asyncio.run(working(account(port), later, story))
    assert len(arrived(tmp_path)) == 1


def test_one_message_id_is_delivered_once_also_after_the_servers_restart(start_mail: Any, tmp_path: Path) -> None:
    server = start_mail()
    config = account(server.ready["port"])
    sent(config, Outbox(tmp_path / "a", 20), mail("<1@nao>"))
    sent(config, Outbox(tmp_path / "b", 20), mail("<1@nao>"))  # a robot that lost power before its note
    server.stop()
    again = account(start_mail().ready["port"])
    assert sent(again, Outbox(tmp_path / "c", 20), mail("<1@nao>")).state == "sent"
    assert len(arrived(tmp_path)) == 1


def test_a_bad_recipient_is_refused_and_the_good_one_gets_the_mail(start_mail: Any, outbox: Outbox, tmp_path: Path) -> None:
    port = start_mail("--domain", "home.example").ready["port"]
    letter = sent(account(port), outbox, mail("<1@nao>", "zofia@home.example", "eve@elsewhere.example"))
    assert (letter.state, list(letter.refused)) == ("sent", ["eve@elsewhere.example"])
    assert "550 5.7.1" in letter.refused["eve@elsewhere.example"]
    assert len(arrived(tmp_path)) == 1


def test_a_server_that_trickles_holds_nobody(outbox: Outbox) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def trickle() -> None:
            connection, _ = listener.accept()
            with connection:
                try:
                    while True:
                        connection.sendall(b"2")
                        time.sleep(0.05)
                except OSError:
                    return

        thread = threading.Thread(target=trickle)
        thread.start()
        config = account(listener.getsockname()[1], connect_timeout=30.0, transfer_timeout=0.5)
        with pytest.raises(Unreachable):
            send_bare(config)
        thread.join(10)
        assert not thread.is_alive()


def test_a_refusal_at_the_greeting_is_told_in_the_servers_words_and_is_not_the_mails() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def refuse() -> None:
            connection, _ = listener.accept()
            with connection:
                connection.sendall(b"554 no mail\x1b[31m from robots\r\n")

        thread = threading.Thread(target=refuse)
        thread.start()
        with pytest.raises(Unreachable, match=r"554 no mail \[31m from robots"):
            send_bare(account(listener.getsockname()[1]))
        thread.join(10)
