"""From sounds to words: when they are wanted, against which vocabulary, and what is told of them."""

import threading

import numpy
import pytest

from rapp_nao_sim.sound.room import BLOCK
from rapp_nao_sim.speech.hearing import MOST, NOTHING, Hearing, HearingError
from rapp_nao_sim.speech.process import EarsError

PATIENCE = 5.0  # s


class SlowEars:
    """Ears that take every sound for the first word of the vocabulary, when the test lets them."""

    def __init__(self):
        self.asked, self.go_on = threading.Semaphore(0), threading.Semaphore(0)
        self.failing = False
        self.count = 0

    def learn(self, vocabulary):
        if "unspeakable" in vocabulary:
            raise EarsError("cannot learn to hear 'unspeakable'")

    def recognise(self, vocabulary, _samples):
        self.count += 1
        self.asked.release()
        assert self.go_on.acquire(timeout=PATIENCE)
        if self.failing:
            raise EarsError("cannot recognise: the ears' process died")
        return [(vocabulary[0], 0.9)]


class Desk:
    """A Hearing, the memory it writes to, and a microphone."""

    def __init__(self, ears=None):
        self.ears = ears
        self.values, self.events = {}, []
        self.told = threading.Semaphore(0)
        self.speaking = threading.Event()
        self.hearing = Hearing(self.values.__setitem__, self.raise_event, ears, self.speaking)
        self._random = numpy.random.default_rng(1)
        self.hearing.start()
        self.hear(60, 10)

    def raise_event(self, key, value):
        self.events.append((key, value))
        if key == "WordRecognized":
            self.told.release()

    def listen(self, *vocabulary):
        self.hearing.pause(True)
        self.hearing.set_vocabulary(list(vocabulary))
        self.hearing.pause(False)
        self.hearing.subscribe("test")

    def hear(self, level, blocks):
        for _ in range(blocks):
            self.hearing.feed(self._random.normal(0, level, BLOCK).astype(numpy.int16))

    def hear_sound(self):
        self.hear(2000, 20)
        self.hear(60, 40)

    def words(self, count):
        """The words told, once there are as many."""
        for _ in range(count):
            assert self.told.acquire(timeout=PATIENCE), self.events
        return [value for key, value in self.events if key == "WordRecognized"]

    def sounds(self):
        return [value[0][1] for key, value in self.events if key == "SoundDetected"]


@pytest.fixture
def desk():
    desk = Desk()
    yield desk
    desk.hearing.close()


@pytest.fixture
def slow():
    desk = Desk(SlowEars())
    yield desk
    desk.ears.go_on.release(100)
    desk.hearing.close()


def test_a_word_is_told_with_its_probability(desk):
    desk.listen("e-mail", "clock")
    desk.hearing.feed_text("Clock")
    assert desk.words(1) == [["clock", 1.0]]
    assert desk.values["LastWordRecognized"] == ["clock", 1.0]


def test_subscribing_forgets_the_word_before(desk):
    desk.listen("clock")
    assert desk.values["WordRecognized"] == NOTHING


def test_nothing_is_told_unless_it_is_wanted(desk):
    desk.hearing.set_vocabulary(["clock"])
    desk.hearing.feed_text("clock")  # nobody has subscribed
    desk.hearing.subscribe("test")
    desk.hearing.pause(True)
    desk.hearing.feed_text("clock")  # paused
    desk.hearing.pause(False)
    desk.speaking.set()
    desk.hearing.feed_text("clock")  # the robot itself speaks
    desk.speaking.clear()
    desk.hearing.unsubscribe("test")
    desk.hearing.feed_text("clock")  # nobody listens any more
    desk.listen("now")
    desk.hearing.feed_text("now")
    assert desk.words(1) == [["now", 1.0]]


def test_two_subscribers_are_two(desk):
    desk.listen("clock")
    desk.hearing.subscribe("other")
    desk.hearing.unsubscribe("test")
    assert desk.hearing.listening
    desk.hearing.unsubscribe("other")
    assert not desk.hearing.listening


def test_the_vocabulary_cannot_change_while_listening(desk):
    desk.listen("clock")
    with pytest.raises(HearingError, match="pause it first"):
        desk.hearing.set_vocabulary(["e-mail"])
    desk.hearing.feed_text("clock")
    assert desk.words(1) == [["clock", 1.0]]


def test_a_vocabulary_that_cannot_be_learnt_leaves_the_old_one(slow):
    slow.listen("clock")
    slow.hearing.pause(True)
    with pytest.raises(EarsError):
        slow.hearing.set_vocabulary(["unspeakable"])
    slow.hearing.pause(False)
    slow.hear_sound()
    slow.ears.go_on.release()
    assert slow.words(1) == [["clock", 0.9]]


def test_a_sound_that_waits_is_not_matched_against_the_next_vocabulary(slow):
    slow.listen("clock")
    slow.hear_sound()
    assert slow.ears.asked.acquire(timeout=PATIENCE)
    slow.hear_sound()  # waits behind the first
    slow.listen("e-mail")
    slow.ears.go_on.release()  # the first ends too late
    slow.hear_sound()
    slow.ears.go_on.release()
    assert slow.words(1) == [["e-mail", 0.9]]
    assert slow.ears.count == 2  # the one that waited was never asked for


def test_a_sound_recognised_after_the_end_of_listening_is_not_told(slow):
    slow.listen("clock")
    slow.hear_sound()
    assert slow.ears.asked.acquire(timeout=PATIENCE)
    slow.hearing.unsubscribe("test")
    slow.ears.go_on.release()
    slow.listen("e-mail")
    slow.hear_sound()
    slow.ears.go_on.release()
    assert slow.words(1) == [["e-mail", 0.9]]


def test_ears_that_fail_are_asked_again_at_the_next_sound(slow):
    slow.listen("clock")
    slow.ears.failing = True
    slow.hear_sound()
    assert slow.ears.asked.acquire(timeout=PATIENCE)
    slow.ears.go_on.release()
    slow.hear_sound()
    assert slow.ears.asked.acquire(timeout=PATIENCE)
    slow.ears.failing = False
    slow.ears.go_on.release()
    assert slow.words(1) == [["clock", 0.9]]


def test_more_sounds_than_can_wait_are_left_out_and_closing_does_not_hang(slow):
    slow.listen("clock")
    for _ in range(MOST + 5):
        slow.hear_sound()
    closer = threading.Thread(target=slow.hearing.close)
    closer.start()
    slow.ears.go_on.release(100)
    closer.join(PATIENCE)
    assert not closer.is_alive()
    assert slow.ears.count <= 2


def test_starts_and_ends_of_sounds_are_told_to_who_wants_them(desk):
    desk.hear_sound()
    assert desk.sounds() == []
    desk.hearing.detect("test", True)
    desk.hear_sound()
    assert desk.sounds() == [1, 0]
    desk.hearing.detect("test", False)
    desk.hear_sound()
    assert desk.sounds() == [1, 0]


def test_a_sound_into_which_the_robot_speaks_ends(desk):
    desk.listen("clock")
    desk.hearing.detect("test", True)
    desk.hear(2000, 20)
    desk.speaking.set()
    desk.hear(3000, 50)
    desk.speaking.clear()
    desk.hear(60, 50)
    assert desk.sounds() == [1, 0]
    assert [value for key, value in desk.events if key == "SpeechDetected"] == [1, 0]
