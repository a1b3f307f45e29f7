"""The core agent's own word beside the vocabularies of others."""

from collections.abc import Sequence

import pytest

from fakes.robot import FakeRobot
from rapp_core.config import Config
from rapp_core.control.attention import Attention, OwnVoice
from rapp_core.control.words import STOP
from rapp_core.errors import Refused, Unreachable
from rapp_core.ports import Sound, Word

SURE = 0.8


class Room:
    """A robot with attention for "stop", and what it was told."""

    def __init__(self) -> None:
        self.fake = FakeRobot()
        self.voice = OwnVoice(self.fake.robot.voice, Config(), self.fake.body.clock.now)
        self.attention = Attention(self.fake.robot.ears, "stop", Config(), self.voice, self.fake.body.clock.now)
        self.called: list[str] = []
        self.heard: list[Word | Sound] = []

    def attend(self) -> None:
        self.attention.attend(self.called.append)

    def listen(self, *words: str) -> None:
        """As a RApp does."""
        self.attention.set_vocabulary(words)
        self.attention.subscribe(self.heard.append)

    def say(self, text: str, probability: float = SURE) -> None:
        self.fake.person_says(text, probability)
        self.fake.body.clock.advance(1.0)

    def words(self) -> list[str]:
        return [item.text for item in self.heard if isinstance(item, Word)]


@pytest.fixture
def room() -> Room:
    return Room()


def test_while_nobody_listens_it_hears_its_word(room: Room) -> None:
    room.attend()
    room.say("clock")
    room.say("stop")
    assert room.called == ["stop"]
    assert room.fake.body.vocabulary == ["stop"]


def test_without_attention_it_is_the_ears_themselves(room: Room) -> None:
    room.listen("clock", "stop")
    room.say("stop")
    room.say("clock")
    assert room.words() == ["stop", "clock"]
    assert room.called == []


def test_it_hears_its_word_beside_a_rapp_that_hears_the_others(room: Room) -> None:
    room.attend()
    room.listen("clock", "radio")
    room.say("clock")
    room.say("stop")
    assert (room.words(), room.called) == (["clock"], ["stop"])


def test_after_the_rapp_has_listened_it_goes_on(room: Room) -> None:
    room.attend()
    room.listen("clock")
    room.attention.unsubscribe()
    room.say("clock")
    room.say("stop")
    assert (room.words(), room.called) == ([], ["stop"])


def test_a_rapp_that_listens_already_when_it_begins_goes_on(room: Room) -> None:
    room.listen("clock")
    room.attend()
    room.say("stop")
    room.say("clock")
    assert (room.words(), room.called) == (["clock"], ["stop"])


@pytest.mark.parametrize("spelt", ["stop", "Stop", " STOP "])
def test_a_rapp_cannot_take_the_word(room: Room, spelt: str) -> None:
    room.attend()
    room.listen("clock", spelt)
    room.say("stop")
    assert (room.words(), room.called) == ([], ["stop"])
    assert room.fake.body.vocabulary == ["clock", "stop"]


def test_a_word_that_is_not_sure_is_nobody_s(room: Room) -> None:
    room.attend()
    room.listen("clock")
    room.say("stop", 0.45)
    assert (room.words(), room.called) == ([], [])


@pytest.mark.parametrize(("seconds", "called"), [(0.9, ["stop"]), (2.0, [])])
def test_within_a_sentence_the_word_is_part_of_that(room: Room, seconds: float, called: list[str]) -> None:
    """Who dictates "please stop by the shop" does not stop the robot."""
    room.attend()
    room.fake.person_says("stop", SURE, seconds)
    room.fake.body.clock.advance(seconds + 1.0)
    assert room.called == called


def test_what_the_robot_says_itself_is_not_the_person(room: Room) -> None:
    room.attend()
    room.fake.robot.voice.say = lambda *_: room.say("stop")  # type: ignore[method-assign]
    room.voice.say("I stop now", "en")
    assert room.called == []
    room.fake.body.clock.advance(1.0)
    room.say("stop")
    assert room.called == ["stop"]


def test_ignoring_ends_it(room: Room) -> None:
    room.attend()
    room.attention.ignore()
    room.attention.ignore()
    assert room.fake.body.listener is None
    room.listen("clock")
    room.attend()
    room.attention.ignore()
    room.say("clock")
    assert room.words() == ["clock"]


def test_a_robot_that_was_away_is_attended_to_again(room: Room) -> None:
    room.attend()
    room.listen("clock")
    room.fake.body.here = False
    with pytest.raises(Unreachable):
        room.attention.unsubscribe()
    room.fake.body.here = True
    room.attend()
    room.say("stop")
    assert room.called == ["stop"]


def test_after_a_new_session_whoever_listens_hears_again(room: Room) -> None:
    room.attend()
    room.listen("clock")
    room.fake.body.listener = None
    room.attend()
    room.say("clock")
    room.say("stop")
    assert (room.words(), room.called) == (["clock"], ["stop"])


def test_a_word_that_the_robot_does_not_take_takes_nobody_else_s(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    take = room.fake.robot.ears.set_vocabulary

    def refuse(words: Sequence[str]) -> None:
        if "stop" in words:
            raise Refused("cannot recognise 'stop'")
        take(words)

    monkeypatch.setattr(room.fake.robot.ears, "set_vocabulary", refuse)
    with pytest.raises(Refused):
        room.attend()
    room.listen("clock")
    room.say("clock")
    assert room.words() == ["clock"]


def test_in_a_language_without_the_word_nothing_is_listened_for(room: Room) -> None:
    deaf = Attention(room.fake.robot.ears, STOP.get("xx"), Config(), room.voice)
    deaf.attend(room.called.append)
    deaf.ignore()
    assert room.fake.journal == []


def test_each_language_s_word_is_told_as_it_is_compared() -> None:
    assert all(word == word.strip().casefold() for word in STOP.values())
