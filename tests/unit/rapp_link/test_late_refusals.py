"""A mail that was kept, and is then refused or given up: its content stays, and it is told until the person knows."""

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rapp_hop.errors import Refused
from rapp_link import outbox as outbox_module
from rapp_link.commands import Commands, sign_of_life
from rapp_link.config import Config, MailConfig
from rapp_link.letter import Letter, Outcome, from_json, to_json
from rapp_link.message import Built, Mail, build
from rapp_link.outbox import Outbox
from rapp_link.postman import Postman

ME = "nao@home.example"
ANNA, BERT = "anna@home.example", "bert@home.example"
CONFIG = MailConfig(host="mail", sender=ME, retry_first=0.001, retry_most=0.001)
LATER, NO = "451 try again later", "550 no such mailbox"


class EnoughError(Exception):
    """The link ends."""


class Server:
    """Answers try after try with one outcome after the other; the last one stays."""

    def __init__(self, *outcomes: Outcome) -> None:
        self.outcomes = list(outcomes)

    async def send(self, sender: str, recipients: Sequence[str], content: bytes) -> Outcome:
        return self.outcomes.pop(0) if len(self.outcomes) > 1 else self.outcomes[0]


def built(message_id: str = "<1@nao>", *recipients: str) -> Built:
    return build(Mail(recipients or (ANNA,), "subject", "body", message_id), ME, datetime.now(UTC))


def working(outbox: Outbox, server: Server, story: Callable[[Postman], Awaitable[None]], now: float = 0.0) -> None:
    async def work() -> None:
        postman = Postman(outbox, server, CONFIG, lambda: now)
        task = asyncio.create_task(postman.run())
        try:
            async with asyncio.timeout(10):
                await story(postman)
        finally:
            task.cancel()

    asyncio.run(work())


async def until_done(outbox: Outbox) -> None:
    while outbox.queued():
        await asyncio.sleep(0.001)


def contents(folder: Path) -> int:
    return len(list(folder.glob("outbox/*/message.eml")))


@pytest.fixture
def outbox(tmp_path: Path) -> Outbox:
    return Outbox(tmp_path / "outbox", 5)


def known(outbox: Outbox, message_id: str = "<1@nao>") -> Letter:
    letter = outbox.find(message_id)
    assert letter is not None
    return letter


def refused_late(outbox: Outbox, message_id: str = "<1@nao>", at: float = 0.0) -> None:
    letter = outbox.put(built(message_id), ME, at)
    outbox.update(letter.after(Outcome(later={ANNA: LATER})).after(Outcome(refused={ANNA: NO})))


def test_kept_and_then_refused_it_stays_and_is_to_be_told_over_a_restart_until_it_was(outbox: Outbox, tmp_path: Path) -> None:
    async def story(postman: Postman) -> None:
        letter = await postman.deliver(outbox.put(built(), ME, 0.0), 5)
        assert letter.state == "queued"
        await until_done(outbox)

    working(outbox, Server(Outcome(later={ANNA: LATER}), Outcome(refused={ANNA: NO})), story)
    for box in (outbox, Outbox(tmp_path / "outbox", 5)):
        letter = box.untold()
        assert letter is not None
        assert (letter.state, letter.untold, letter.refused) == ("refused", (ANNA,), {ANNA: NO})
        assert contents(tmp_path) == 1
    outbox.told("<1@nao>", (ANNA,), late=True)
    for box in (outbox, Outbox(tmp_path / "outbox", 5)):
        assert box.untold() is None
        assert known(box).undelivered == (ANNA,)
        assert contents(tmp_path) == 1


def test_given_up_after_days_it_stays_and_is_to_be_told(outbox: Outbox, tmp_path: Path) -> None:
    outbox.put(built(), ME, 0.0)
    working(outbox, Server(Outcome(later={ANNA: LATER})), lambda _: until_done(outbox), now=CONFIG.give_up + 1)
    letter = outbox.untold()
    assert letter is not None
    assert "given up" in letter.refused[ANNA]
    assert contents(tmp_path) == 1


def test_one_whose_sender_is_told_at_once_does_not_stay(outbox: Outbox, tmp_path: Path) -> None:
    letter = outbox.put(built(), ME, 0.0)
    outbox.update(letter.after(Outcome(refused={ANNA: NO})))
    outbox.told("<1@nao>", (ANNA, BERT), late=False)
    assert outbox.untold() is None
    assert contents(tmp_path) == 0


def test_an_answer_may_be_lost_on_the_way_so_it_counts_as_told_when_its_asker_says_so(outbox: Outbox, tmp_path: Path) -> None:
    mail = {"recipients": [ANNA], "subject": "subject", "body": "body", "attachment": "", "message_id": "<1@nao>"}
    ticket: Any = SimpleNamespace(remaining=10.0)

    async def story(postman: Postman) -> None:
        parts: Any = (Config(tmp_path, mail=CONFIG), None, None, outbox, postman, None, None)
        commands = Commands(*parts)
        with pytest.raises(Refused, match=NO):
            await commands.send_mail(mail, ticket)
        assert known(outbox).untold == (ANNA,)
        await commands.mail_told({"message_id": "<1@nao>", "recipients": [ANNA], "late": False}, ticket)

    working(outbox, Server(Outcome(refused={ANNA: NO})), story)
    assert outbox.untold() is None
    assert contents(tmp_path) == 0


def test_of_two_recipients_only_the_one_refused_later_is_told_later(outbox: Outbox, tmp_path: Path) -> None:
    letter = outbox.put(built("<1@nao>", ANNA, BERT), ME, 0.0)
    outbox.update(letter.after(Outcome(refused={ANNA: NO}, later={BERT: LATER})))
    outbox.told("<1@nao>", (ANNA, BERT), late=False)
    outbox.update(known(outbox).after(Outcome(refused={BERT: NO})))
    assert known(outbox).untold == (BERT,)
    assert contents(tmp_path) == 1


def test_one_refused_while_the_other_was_told_is_still_to_be_told(outbox: Outbox, tmp_path: Path) -> None:
    letter = outbox.put(built("<1@nao>", ANNA, BERT), ME, 0.0)
    outbox.update(letter.after(Outcome(refused={ANNA: NO}, later={BERT: LATER})))
    outbox.update(known(outbox).after(Outcome(refused={BERT: NO})))
    for late in (True, False):
        outbox.told("<1@nao>", (ANNA,), late=late)
        assert known(outbox).untold == (BERT,)
    outbox.told("<1@nao>", (BERT,), late=True)
    assert outbox.untold() is None
    assert contents(tmp_path) == 1


def test_only_the_newest_that_were_not_delivered_keep_their_content(
    outbox: Outbox, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox_module, "UNDELIVERED", 2)
    for number in range(4):
        refused_late(outbox, f"<{number}@nao>", float(number))
    assert contents(tmp_path) == 2
    assert outbox.content(known(outbox, "<3@nao>"))
    assert known(outbox, "<0@nao>").untold, "it is told all the same"


def test_a_letter_of_an_older_link_is_not_told_again() -> None:
    letter = Letter("<1@nao>", ME, (ANNA,), "", 0.0, (ANNA,)).after(Outcome(refused={ANNA: NO}))
    text = to_json(letter).replace(b', "told": [], "late": []', b"")
    assert b"told" not in text
    assert from_json(text).untold == ()


def test_the_sign_of_life_names_the_oldest_until_it_was_told(outbox: Outbox) -> None:
    refused_late(outbox, "<2@nao>", 2.0)
    refused_late(outbox, "<1@nao>", 1.0)
    signs: list[dict[str, Any]] = []

    def publish(sign: dict[str, Any]) -> None:
        signs.append(sign)
        if sign["undelivered"] is None:
            raise EnoughError
        outbox.told(**sign["undelivered"], late=True)

    class Platform:
        reachable = True

    with pytest.raises(EnoughError):
        asyncio.run(sign_of_life(publish, Platform(), outbox, "boot", 0.0))  # type: ignore[arg-type]
    named = [sign["undelivered"] and (sign["undelivered"]["message_id"], sign["undelivered"]["recipients"]) for sign in signs]
    assert named == [("<1@nao>", (ANNA,)), ("<2@nao>", (ANNA,)), None]
