"""What the robot says: one text after another, and what stops it at any moment."""

import threading

import numpy
import pytest

from rapp_nao_sim.sound.room import BLOCK, Mixer
from rapp_nao_sim.sound.synthesis import VoiceError
from rapp_nao_sim.speech import mouth as mouth_module
from rapp_nao_sim.speech.mouth import Mouth, MouthError, Saying

PATIENCE = 5.0  # s


class Studio:
    """A mouth whose synthesis and sound go on when the test says so."""

    def __init__(self):
        self.mixer = Mixer(0.0)
        self.events, self.said = [], []
        self.speaking = threading.Event()
        self.begun, self.go_on = threading.Semaphore(0), threading.Semaphore(0)
        self.mouth = Mouth(self.mixer, self.raise_event, self.said.append, self.speaking, synthesise=self.synthesise)
        self.sounding = threading.Semaphore(0)

    def raise_event(self, key, value):
        self.events.append((key.removeprefix("ALTextToSpeech/"), value))
        if key.endswith("TextStarted") and value:
            self.sounding.release()

    def synthesise(self, text, voice, speed):
        self.begun.release()
        assert self.go_on.acquire(timeout=PATIENCE)
        if voice == "none":
            raise VoiceError("cannot speak: no such voice")
        if voice == "broken":
            raise ZeroDivisionError
        return numpy.full(BLOCK * len(text), 0.5, numpy.float32)

    def say(self, text, voice="en"):
        return self.mouth.say(Saying(text, voice, 150, 1.0))

    def synthesised(self):
        """Let the synthesis of the next text end, and wait until that sounds."""
        self.go_on.release()
        assert self.sounding.acquire(timeout=PATIENCE)

    def sound(self, blocks):
        for _ in range(blocks):
            self.mixer.block()


@pytest.fixture
def studio():
    studio = Studio()
    studio.mouth.start()
    yield studio
    studio.go_on.release(100)
    studio.mouth.close()


WHOLE = [("TextStarted", 1), ("TextStarted", 0), ("TextDone", 1)]
STOPPED = [("TextStarted", 1), ("TextStarted", 0), ("TextInterrupted", 1)]


def test_a_text_is_said_to_its_end(studio):
    done = studio.say("hey")
    studio.synthesised()
    assert studio.speaking.is_set()
    assert not done.done()
    studio.sound(3)
    assert done.result(PATIENCE) is True
    assert not studio.speaking.is_set()
    assert studio.events == [("CurrentSentence", "hey"), *WHOLE]
    assert studio.said == ["hey"]


def test_texts_are_said_in_their_order(studio):
    waiting = [studio.say(text) for text in ("a", "b", "c")]
    for done in waiting:
        studio.synthesised()
        studio.sound(1)
        assert done.result(PATIENCE) is True
    assert studio.said == ["a", "b", "c"]


def test_stopped_while_it_sounds(studio):
    done = studio.say("hey")
    studio.synthesised()
    studio.sound(1)
    studio.mouth.stop()
    assert done.result(PATIENCE) is False
    assert studio.events == [("CurrentSentence", "hey"), *STOPPED]
    assert studio.said == []
    assert not studio.speaking.is_set()


def test_stopped_during_its_synthesis_it_does_not_sound(studio):
    done = studio.say("hey")
    assert studio.begun.acquire(timeout=PATIENCE)
    studio.mouth.stop()
    studio.go_on.release()
    assert done.result(PATIENCE) is False
    assert (studio.events, studio.said) == ([], [])
    assert not studio.mixer.block().any()


def test_stopping_forgets_what_waits(studio):
    waiting = [studio.say(text) for text in ("a", "b", "c")]
    studio.synthesised()
    studio.mouth.stop()
    assert [done.result(PATIENCE) for done in waiting] == [False] * 3
    assert studio.said == []


def test_what_is_said_after_a_stop_is_said(studio):
    studio.say("a")
    assert studio.begun.acquire(timeout=PATIENCE)
    studio.mouth.stop()
    done = studio.say("b")
    studio.go_on.release()
    studio.synthesised()
    studio.sound(1)
    assert done.result(PATIENCE) is True
    assert studio.said == ["b"]


def test_stopping_a_quiet_mouth_does_not_stop_the_next_text(studio):
    studio.mouth.stop()
    done = studio.say("a")
    studio.synthesised()
    studio.sound(1)
    assert done.result(PATIENCE) is True


@pytest.mark.parametrize(("voice", "error"), [("none", VoiceError), ("broken", ZeroDivisionError)])
def test_a_text_that_cannot_be_said_is_an_error_and_the_next_is_said(studio, voice, error):
    failed, done = studio.say("a", voice), studio.say("b")
    studio.go_on.release()
    assert isinstance(failed.exception(PATIENCE), error)
    studio.synthesised()
    studio.sound(1)
    assert done.result(PATIENCE) is True


def test_too_many_texts_are_refused(studio, monkeypatch):
    monkeypatch.setattr(mouth_module, "MOST", 2)
    studio.say("a")
    assert studio.begun.acquire(timeout=PATIENCE)
    studio.say("b")
    studio.say("c")
    with pytest.raises(MouthError, match="2 texts wait"):
        studio.say("d")


def test_closing_ends_all_that_waits():
    studio = Studio()
    studio.mouth.start()
    waiting = [studio.say(text) for text in ("a", "b")]
    studio.synthesised()
    studio.mouth.close()
    assert [done.result(0) for done in waiting] == [False, False]
    with pytest.raises(MouthError):
        studio.say("c")


def test_a_silent_mouth_says_without_sound_or_synthesis():
    studio = Studio()
    mouth = Mouth(studio.mixer, studio.raise_event, studio.said.append, studio.speaking, silent=True)
    mouth.start()
    assert mouth.say(Saying("hey", "none", 150, 1.0)).result(PATIENCE) is True
    mouth.close()
    assert studio.events == [("CurrentSentence", "hey"), *WHOLE]
    assert studio.said == ["hey"]
