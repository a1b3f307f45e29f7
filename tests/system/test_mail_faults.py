"""The mail server is away, or refuses: the message is kept and sent when it can be, once, and the person is told which it is."""

import email
import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from fakes.faulty_mail import LATER, LOST_AFTER_DATA, NO_LOGIN, NO_RECIPIENT, NONE, Fault
from fakes.robot_behind_faults import RobotBehindFaults
from fakes.whole_robot import entered, processes_of
from rapp_cli.paths import STORE

pytestmark = [pytest.mark.system, pytest.mark.timeout(180)]

SENT = "I have finished, your message to Elizabeth is sent"
KEPT = "I cannot reach the mail server, I keep your message and send it later"
LOCKED = "the mail server does not let me in, I keep your message and send it when it does"
REFUSED = "the mail server refuses your message to Elizabeth, I cannot send it"
NOT_TAKEN = "The mail server does not take your message to elizabeth@home.example, I could not send it, and keep it"
UNKNOWN = "I do not know whether your message to Elizabeth is sent, it may still be sent"
PROFILE = {"name": "Maria", "language": "en", "contacts": [{"name": "Elizabeth", "address": "elizabeth@home.example"}]}


def short_voice_mail(folder: Path) -> Path:
    """Voice-mail that records a moment only."""
    shutil.copytree(STORE / "voice_mail", folder)
    path = folder / "package.json"
    manifest = json.loads(path.read_text())
    manifest["rapp"]["parameters"]["message_seconds"] = 0.5
    path.write_text(json.dumps(manifest))
    return folder


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RobotBehindFaults]:
    folder = tmp_path_factory.mktemp("mail")
    robot = RobotBehindFaults(folder, [short_voice_mail(folder / "voice_mail")], PROFILE, login=True)
    try:
        robot.start()
        yield robot
    finally:
        robot.close()
    assert processes_of(folder) == []


@pytest.fixture(autouse=True)
def mended(robot: RobotBehindFaults) -> Iterator[None]:
    """Each case begins without faults and with an empty mailbox."""
    meet(robot, NONE)
    robot.wait_for(lambda: not kept(robot))
    for path in delivered(robot):
        path.unlink()
    yield
    meet(robot, NONE)


def meet(robot: RobotBehindFaults, *faults: Fault) -> None:
    """The next connections to the mail server meet these faults, all later ones the last."""
    waiting = list(faults)
    robot.mail_line.choose = lambda: waiting.pop(0) if len(waiting) > 1 else waiting[0]


def delivered(robot: RobotBehindFaults) -> list[Path]:
    return list((robot.maildir / "new").iterdir())


def kept(robot: RobotBehindFaults) -> list[bytes]:
    """Contents of the mails in the outbox."""
    return [path.read_bytes() for path in (robot.home / "link" / "outbox").glob("*/message.eml")]


def message_id(content: bytes) -> str:
    return str(email.message_from_bytes(content)["Message-ID"])


def dictate(robot: RobotBehindFaults) -> str:
    """The person has a message sent; gives the robot's last words."""
    since = len(robot.seen)
    robot.ask("e-mail")
    robot.until(entered("s32", "dynamic"), since)
    robot.say_until("Elizabeth", lambda seen: entered("s33", "dynamic")(seen), since)
    robot.until_listening(robot.seen.index(robot.until(entered("s10"), since)))
    return [seen.detail for seen in robot.seen[since:] if (seen.kind, seen.state) == ("said", "s9")][-1]


def wait_sent(robot: RobotBehindFaults) -> str:
    """Wait until the outbox is empty; gives the Message-ID of the one mail that has come."""
    robot.wait_for(lambda: not kept(robot))
    (mail,) = delivered(robot)
    return message_id(mail.read_bytes())


def test_sent(robot: RobotBehindFaults) -> None:
    assert dictate(robot) == SENT
    assert wait_sent(robot)


def test_away_it_is_kept_over_a_kill_of_the_link_and_sent_once(robot: RobotBehindFaults) -> None:
    robot.kill("mail")
    assert dictate(robot) == KEPT
    (content,) = kept(robot)
    robot.kill("link")
    robot.start("link")
    robot.start("mail")
    assert wait_sent(robot) == message_id(content)


@pytest.mark.parametrize(("fault", "words"), [(LATER, KEPT), (NO_LOGIN, LOCKED)], ids=["busy", "no login"])
def test_not_now_it_is_kept_and_sent_once(robot: RobotBehindFaults, fault: Fault, words: str) -> None:
    meet(robot, fault)
    assert dictate(robot) == words
    (content,) = kept(robot)
    meet(robot, NONE)
    assert wait_sent(robot) == message_id(content)


def test_a_connection_lost_after_the_mail_delivers_it_once(robot: RobotBehindFaults) -> None:
    before = len(robot.mail_line.sent)
    meet(robot, LOST_AFTER_DATA, NONE)
    assert dictate(robot) == KEPT
    (there,) = delivered(robot)
    identity = message_id(there.read_bytes())
    assert [message_id(content) for content in kept(robot)] == [identity], "the robot cannot know that it has come"
    assert wait_sent(robot) == identity
    assert [message_id(content) for content in robot.mail_line.sent[before:]] == [identity, identity]


def test_a_recipient_who_is_refused_is_told_and_not_tried_again(robot: RobotBehindFaults) -> None:
    meet(robot, NO_RECIPIENT, NONE)
    assert dictate(robot) == REFUSED
    assert kept(robot) == []
    assert delivered(robot) == []


def test_kept_and_then_refused_it_is_told_at_the_next_chance_once_and_stays(robot: RobotBehindFaults) -> None:
    since = len(robot.seen)
    meet(robot, LATER, NO_RECIPIENT)
    assert dictate(robot) == KEPT
    said = robot.until(lambda seen: (seen.kind, seen.detail) == ("said", NOT_TAKEN), since)
    assert said.state == "s3"
    robot.kill("link")
    robot.start("link")
    assert dictate(robot) == REFUSED
    assert [seen.detail for seen in robot.seen[since:] if seen.kind == "said"].count(NOT_TAKEN) == 1
    (content,) = (robot.home / "link" / "outbox").glob("*/message.eml")
    assert message_id(content.read_bytes())
    content.unlink()


def test_the_link_killed_while_it_sends_is_asked_again_and_the_mail_comes_once(robot: RobotBehindFaults) -> None:
    since = len(robot.seen)
    meet(robot, Fault("CONTENT", "held", seen=True), NONE)
    robot.ask("e-mail")
    robot.until(entered("s32", "dynamic"), since)
    robot.say_until("Elizabeth", entered("s33", "dynamic"), since)
    robot.wait_for(lambda: len(delivered(robot)) == 1)
    robot.kill("link")
    robot.start("link")
    said = robot.until(lambda seen: (seen.kind, seen.detail) == ("said", SENT), since)
    robot.until_listening(robot.seen.index(said))
    assert wait_sent(robot)


def test_of_a_link_that_stays_away_nothing_is_promised_and_the_mail_comes_once(robot: RobotBehindFaults) -> None:
    since, met = len(robot.seen), len(robot.mail_line.met)
    meet(robot, Fault("CONTENT", "held"), NONE)
    robot.ask("e-mail")
    robot.until(entered("s32", "dynamic"), since)
    robot.say_until("Elizabeth", entered("s33", "dynamic"), since)
    robot.wait_for(lambda: len(robot.mail_line.met) > met)
    robot.kill("link")
    said = robot.until(lambda seen: (seen.kind, seen.detail) == ("said", UNKNOWN), since)
    robot.until_listening(robot.seen.index(said))
    assert delivered(robot) == []
    robot.start("link")
    assert wait_sent(robot)
