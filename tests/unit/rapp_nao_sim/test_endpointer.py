"""Where sounds begin and end, block by block of 20 ms."""

import numpy
import pytest

from rapp_nao_sim.sound.endpointer import HANG, LEAD, LONGEST, STEADY, Ended, Endpointer, Started, energy
from rapp_nao_sim.sound.room import BLOCK
from rapp_nao_sim.sound.samples import RATE

QUIET, LOUD = 60.0, 1500.0


class Microphone:
    def __init__(self):
        self.endpointer = Endpointer()
        self._random = numpy.random.default_rng(1)
        self.time = 0.0

    def hear(self, level, seconds):
        """Noise of a level for a while; gives the changes with their times."""
        changes = []
        for _ in range(round(seconds * RATE / BLOCK)):
            block = self._random.normal(0, level, BLOCK).astype(numpy.int16)
            self.time += BLOCK / RATE
            change = self.endpointer.feed(block)
            if change is not None:
                changes.append((self.time, change))
        return changes


@pytest.fixture
def microphone():
    microphone = Microphone()
    assert microphone.hear(QUIET, 1.0) == []
    return microphone


def kinds(changes):
    return [type(change) for _time, change in changes]


def test_the_energy_of_a_block_is_its_root_mean_square():
    assert energy(numpy.array([3, -3, 3, -3], numpy.int16)) == 3.0
    assert energy(numpy.full(4, -32768, numpy.int16)) == 32768.0
    assert energy(numpy.zeros(0, numpy.int16)) == 0.0


def test_a_quiet_room_is_quiet(microphone):
    assert microphone.hear(QUIET, 10.0) == []


def test_a_sound_begins_and_ends_with_its_duration(microphone):
    assert kinds(microphone.hear(LOUD, 0.6)) == [Started]
    [(when, ended)] = microphone.hear(QUIET, 2.0)
    assert isinstance(ended, Ended)
    assert ended.duration == pytest.approx(0.6, abs=0.08)
    assert when == pytest.approx(1.0 + 0.6 + HANG, abs=0.05)


def test_the_samples_have_the_beginning_in_them(microphone):
    microphone.hear(LOUD, 0.5)
    [(_, ended)] = microphone.hear(QUIET, 1.0)
    levels = [energy(block) for block in ended.samples.reshape(-1, BLOCK)]
    first = next(i for i, level in enumerate(levels) if level > 1000)
    assert first * BLOCK / RATE == pytest.approx(LEAD - 0.06, abs=0.041)  # the sound was seen after three blocks


def test_a_click_is_no_sound(microphone):
    assert microphone.hear(LOUD, 0.04) == []
    assert microphone.hear(QUIET, 1.0) == []


def test_a_pause_within_a_phrase_does_not_end_it(microphone):
    changes = [*microphone.hear(LOUD, 0.4), *microphone.hear(QUIET, HANG - 0.1), *microphone.hear(LOUD, 0.4)]
    assert kinds(changes) == [Started]
    assert kinds(microphone.hear(QUIET, 1.0)) == [Ended]


def test_a_little_more_noise_is_followed(microphone):
    assert microphone.hear(QUIET * 1.4, 5.0) == []
    assert kinds(microphone.hear(QUIET * 1.4 * 4, 0.5)) == [Started]


def test_lasting_noise_becomes_the_floor_and_louder_sounds_are_still_heard(microphone):
    changes = microphone.hear(600.0, 10.0)
    assert kinds(changes) == [Started, Ended]
    assert changes[1][0] - changes[0][0] < STEADY + HANG + 0.1
    assert kinds(microphone.hear(4000.0, 0.5)) == [Started]
    assert kinds(microphone.hear(600.0, 1.0)) == [Ended]


def test_after_noise_the_quiet_is_learnt_again(microphone):
    microphone.hear(600.0, 5.0)
    assert microphone.hear(QUIET, 3.0) == []
    assert kinds([*microphone.hear(400.0, 0.5), *microphone.hear(QUIET, 1.0)]) == [Started, Ended]


def test_speech_without_end_is_cut(microphone):
    changes = []
    for _ in range(50):  # words, with gaps shorter than the hang-over
        changes += [*microphone.hear(LOUD, 0.4), *microphone.hear(QUIET, 0.2)]
    assert kinds(changes)[:2] == [Started, Ended]
    assert changes[1][1].duration == pytest.approx(LONGEST, abs=0.5)


def test_an_interruption_forgets_the_sound_and_keeps_the_floor(microphone):
    assert microphone.endpointer.interrupt() is False
    microphone.hear(LOUD, 0.3)
    assert microphone.endpointer.interrupt() is True
    assert kinds(microphone.hear(LOUD, 0.3)) == [Started]
    assert kinds(microphone.hear(QUIET, 1.0)) == [Ended]
