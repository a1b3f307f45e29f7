"""State s3: isolated keywords and long commands."""

from dataclasses import replace
from pathlib import Path

import pytest

from fakes.clock import Clock
from fakes.robot import FakeRobot
from rapp_core.config import Config
from rapp_core.control.listening import Listener
from rapp_core.errors import Unreachable

CONFIG = Config(
    threshold=0.4, long_command=1.4, longest_keyword=2.5, end_of_command=0.8, verdict=0.8, listening_round=10.0,
    longest_command=30.0,
)  # fmt: skip


QUICK = replace(CONFIG, end_of_command=0.2)


class Room:
    def __init__(self, folder: Path, config: Config = CONFIG) -> None:
        self.clock = Clock()
        self.fake = FakeRobot(self.clock)
        self.recording = folder / "listening" / "command.ogg"
        self._listener = Listener(self.fake.robot, config, self.clock.now)

    def round(self, *keywords: str) -> str | Path | None:
        return self._listener.round(keywords, self.recording, self.clock.event())


@pytest.fixture
def room(tmp_path: Path) -> Room:
    return Room(tmp_path)


def test_a_keyword_is_heard(room: Room) -> None:
    room.fake.person_says_at(2.0, "e-mail")
    assert room.round("clock", "e-mail") == "e-mail"


def test_receptors_are_left_as_they_were_found(room: Room) -> None:
    room.fake.person_says_at(2.0, "e-mail")
    room.round("e-mail")
    assert room.fake.journal == [
        "setVocabulary", "startMicrophonesRecording", "subscribe", "unsubscribe", "stopMicrophonesRecording",
    ]  # fmt: skip
    assert room.fake.body.listener is None
    assert room.fake.body.recording is None


def test_new_keywords_end_a_round_but_no_utterance(room: Room) -> None:
    room.fake.person_says_at(2.0, "e-mail")
    stop = room.clock.event()
    assert room._listener.round(["e-mail"], room.recording, stop, lambda: room.clock.time > 2.3) == "e-mail"
    assert room._listener.round(["e-mail"], room.recording, stop, lambda: True) is None
    assert room.clock.time < 3.0


@pytest.mark.parametrize("seconds", [0.2, 0.6, 1.3])
def test_a_short_sound_that_is_no_keyword_is_nothing(room: Room, seconds: float) -> None:
    room.fake.person_says_at(2.0, "hm", probability=0.39, seconds=seconds)
    assert room.round("e-mail") is None


def test_a_word_below_the_threshold_is_not_heard(room: Room) -> None:
    room.fake.person_says_at(2.0, "e-mail", probability=0.39)
    assert room.round("e-mail") is None
    room.fake.person_says_at(room.clock.time + 2.0, "e-mail", probability=0.41)
    assert room.round("e-mail") == "e-mail"


def test_a_longer_sound_that_is_no_keyword_is_a_long_command(room: Room) -> None:
    room.fake.person_says_at(2.0, "I would like to send a message", seconds=2.4)
    assert room.round("e-mail") == room.recording
    assert room.recording.exists()
    assert room.clock.time == pytest.approx(2.0 + 2.4 + 0.8, abs=0.05)


def test_a_pause_within_a_sentence_does_not_end_it(room: Room) -> None:
    room.fake.person_says_at(2.0, "I would like", seconds=1.0)
    room.fake.person_says_at(3.7, "to send a message", seconds=1.0)
    assert room.round("e-mail") == room.recording
    assert room.clock.time == pytest.approx(4.7 + 0.8, abs=0.05)


def test_what_the_recogniser_rejects_is_taken_without_more_ado(tmp_path: Path) -> None:
    room = Room(tmp_path, QUICK)
    room.fake.person_says_at(2.0, "what time is it", probability=0.1, seconds=2.0)
    assert room.round("e-mail") == room.recording
    assert room.clock.time == pytest.approx(4.0 + 0.2, abs=0.05)


def test_the_recogniser_has_its_time_for_what_could_be_a_keyword(tmp_path: Path) -> None:
    room = Room(tmp_path, QUICK)
    room.fake.person_says_at(2.0, "what the recogniser does not speak of", probability=0.9, seconds=2.0)
    assert room.round("e-mail") == room.recording
    assert room.clock.time == pytest.approx(4.0 + 0.8, abs=0.05)


def test_a_verdict_on_the_sound_before_does_not_count(tmp_path: Path) -> None:
    room = Room(tmp_path, QUICK)
    room.fake.person_says_at(2.0, "hm", probability=0.1, seconds=0.5)
    room.fake.person_says_at(2.7, "what the recogniser does not speak of", probability=0.9, seconds=1.2)
    assert room.round("e-mail") == room.recording
    assert room.clock.time == pytest.approx(3.9 + 0.8, abs=0.05)


def test_a_sound_too_long_for_a_keyword_needs_no_verdict(tmp_path: Path) -> None:
    room = Room(tmp_path, QUICK)
    room.fake.person_says_at(2.0, "what the recogniser does not speak of", probability=0.9, seconds=2.6)
    assert room.round("e-mail") == room.recording
    assert room.clock.time == pytest.approx(4.6 + 0.2, abs=0.05)


def test_a_sentence_is_no_keyword_whatever_the_recogniser_thinks(room: Room) -> None:
    room.fake.person_says_at(2.0, "e-mail", probability=0.95, seconds=3.0)
    assert room.round("e-mail") == room.recording


def test_without_any_keyword_long_commands_still_work(room: Room) -> None:
    room.fake.person_says_at(2.0, "I would like to send a message", seconds=2.4)
    assert room.round() == room.recording
    assert "setVocabulary" not in room.fake.journal


def test_a_word_outside_the_vocabulary_is_no_keyword(room: Room) -> None:
    room.fake.person_says_at(2.0, "left over from before", probability=0.9)
    room.fake.body.vocabulary.append("left over from before")
    assert room.round("e-mail") is None


def test_a_quiet_round_ends_by_itself(room: Room) -> None:
    assert room.round("e-mail") is None
    assert room.clock.time == pytest.approx(10.0, abs=0.05)


def test_a_round_does_not_end_while_somebody_speaks(room: Room) -> None:
    room.fake.person_says_at(9.5, "I would like to send a message", seconds=3.0)
    assert room.round("e-mail") == room.recording


def test_an_endless_sound_is_taken_as_it_is(room: Room) -> None:
    room.fake.person_says_at(1.0, "noise", probability=0.0, seconds=1000.0)
    assert room.round("e-mail") == room.recording
    assert room.clock.time == pytest.approx(31.0, abs=0.1)


def test_a_robot_that_goes_away_ends_the_round(room: Room) -> None:
    room.clock.at(3.0, lambda: setattr(room.fake.body, "here", False))
    with pytest.raises(Unreachable):
        room.round("e-mail")
    assert room.clock.time < 3.1


def test_told_to_end_a_round_ends_at_once(room: Room) -> None:
    stop = room.clock.event()
    room.clock.at(3.0, stop.set)
    assert Listener(room.fake.robot, CONFIG, room.clock.now).round(["e-mail"], room.recording, stop) is None
    assert room.clock.time < 3.1
