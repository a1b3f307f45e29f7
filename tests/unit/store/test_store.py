"""The RApps that come with the repository, against the core agent that authors test with."""

import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from rapp_api import DynamicAgent, RappError, Refused, Unreachable
from rapp_api.entry import load
from rapp_api.testing import FakeCoreAgent

STORE = Path(__file__).parents[3] / "store"
PROFILE = {
    "name": "Maria",
    "contacts": [
        {"name": "Elizabeth", "address": "elizabeth@home.example"},
        {"name": "Doctor Nowak", "address": "nowak@clinic.example"},
    ],
}


def run(name: str, **room: Any) -> FakeCoreAgent:
    """Run a RApp of the store to its end."""
    with FakeCoreAgent(package=STORE / name, **room) as core:
        agent: type[DynamicAgent] = load(STORE / name / "agent.py")
        agent(core.parameters).run()
    return core


def test_voice_mail_sends_what_was_recorded_to_whom_was_named() -> None:
    core = run("voice_mail", hears=["Elizabeth"], services={"profile": PROFILE})
    said = ["starting word recognition", "recording message", "sending e-mail"]
    assert core.said() == [*said, "I have finished, your message to Elizabeth is sent"]
    assert [name for name, _ in core.calls] == ["cloud_call", "say", "recognize", "say", "record", "say", "send_mail", "say"]
    (mail,) = core.mails
    assert mail["recipients"] == ["elizabeth@home.example"]
    assert mail["attachment"] == core.recordings[0]
    assert "Maria" in mail["subject"]


def test_voice_mail_asks_again_for_a_name_it_has_not_understood() -> None:
    core = run("voice_mail", hears=["", "Doctor Nowak"], services={"profile": PROFILE})
    assert core.mails[0]["recipients"] == ["nowak@clinic.example"]
    assert sum("again" in text for text in core.said()) == 1


def test_voice_mail_gives_up_after_three_names_it_has_not_understood() -> None:
    core = run("voice_mail", hears=["", "Peter", ""], services={"profile": PROFILE})
    assert [name for name, _ in core.calls].count("recognize") == 3
    assert not core.mails
    assert not core.recordings
    assert "do not know to whom" in core.said()[-1]


def test_voice_mail_says_that_a_message_is_kept() -> None:
    core = run("voice_mail", hears=["Elizabeth"], services={"profile": PROFILE}, mail="kept")
    assert "later" in core.said()[-1]


@pytest.mark.parametrize(
    ("mail", "words"),
    [
        ("locked", "does not let me in, I keep"),
        (Refused("cannot deliver to elizabeth@home.example: 550"), "refuses your message to Elizabeth"),
        (Refused("cannot keep mails: No space left on device, free some space (/x)"), "I cannot keep mails: No space left"),
        ("unknown", "it may still be sent"),
        (Unreachable("cannot reach the link"), "please try again"),
    ],
)
def test_voice_mail_says_why_a_message_is_not_sent(mail: Any, words: str) -> None:
    core = run("voice_mail", hears=["Elizabeth"], services={"profile": PROFILE}, mail=mail)
    assert words in core.said()[-1]
    assert "/x" not in core.said()[-1]


@pytest.mark.parametrize("profile", [{"name": "Maria", "contacts": []}, Unreachable("cannot reach the platform")])
def test_voice_mail_fails_without_contacts(profile: Any) -> None:
    with pytest.raises(RappError):
        run("voice_mail", services={"profile": profile})


def test_hello_greets_by_name() -> None:
    assert "Maria" in run("hello", services={"profile": PROFILE}).said()[0]


def test_clock_tells_the_hour() -> None:
    assert re.fullmatch(r"it is (\d+ minutes past \d+|\d+ o'clock)", run("clock").said()[0])


def test_parrot_plays_what_it_has_recorded() -> None:
    core = run("parrot")
    assert ("play_audio", core.recordings[0]) in core.calls


def code(text: str) -> "np.ndarray[Any, Any]":
    """A picture of a QR code on a grey wall."""
    marker = cv2.QRCodeEncoder_create().encode(text)
    wall = np.full((480, 640, 3), 90, np.uint8)
    wall[100:340, 200:440] = cv2.cvtColor(cv2.resize(marker, (240, 240), interpolation=cv2.INTER_NEAREST), cv2.COLOR_GRAY2BGR)
    return wall


def test_look_around_says_each_code_once_and_rests() -> None:
    core = run("look_around", pictures=[code('{"name": "kitchen"}')] * 2 + [code("door")])
    assert core.said() == ["I read: kitchen", "I read: door"]
    assert [name for name, _ in core.calls if name == "look_at_point"] == ["look_at_point"] * 6
    assert core.posture == "Sit"


def test_look_around_says_that_there_is_nothing() -> None:
    assert run("look_around").said() == ["I see nothing to read"]
