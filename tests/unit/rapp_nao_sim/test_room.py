"""What the microphone picks up: everything that sounds, mixed, block by block."""

import numpy
import pytest

from rapp_nao_sim.sound.endpointer import energy
from rapp_nao_sim.sound.room import BLOCK, MOST, CrowdedError, Mixer, Room, Sounding


def tone(value, blocks=2.0):
    return Sounding(numpy.full(round(BLOCK * blocks), value, numpy.float32), 1.0)


def level(block):
    return block.mean() / 32767


@pytest.fixture
def mixer():
    return Mixer(0.0)


def test_a_silent_room_is_silent(mixer):
    assert not mixer.block().any()


@pytest.mark.parametrize("ambient", [60.0, 1000.0])
def test_noise_has_the_level_that_is_set(ambient):
    mixer = Mixer(0.0)
    mixer.ambient = ambient
    assert energy(numpy.concatenate([mixer.block() for _ in range(50)])) == pytest.approx(ambient, rel=0.05)


def test_what_sounds_at_once_is_added(mixer):
    mixer.add(tone(0.2))
    mixer.add(tone(0.3))
    assert level(mixer.block()) == pytest.approx(0.5, abs=0.001)


def test_one_voice_begins_while_the_other_goes_on(mixer):
    mixer.add(tone(0.2, blocks=3))
    first = mixer.block()
    mixer.add(tone(0.3, blocks=1))
    levels = [level(first), *(level(mixer.block()) for _ in range(3))]
    assert levels == pytest.approx([0.2, 0.5, 0.2, 0.0], abs=0.001)


def test_what_is_paused_is_silent_and_goes_on_where_it_was(mixer):
    sounding = mixer.add(tone(0.5, blocks=2))
    mixer.block()
    sounding.paused = True
    assert [level(mixer.block()) for _ in range(3)] == [0.0] * 3
    assert not sounding.done.done()
    sounding.paused = False
    assert level(mixer.block()) == pytest.approx(0.5, abs=0.001)
    assert sounding.done.result(0) is True


def test_the_loudspeakers_gain_is_for_what_it_plays_alone(mixer):
    mixer.add(tone(0.2))
    mixer.add(tone(0.4)).loudspeaker = True
    mixer.loudspeaker = 0.5
    assert level(mixer.block()) == pytest.approx(0.4, abs=0.001)


def test_too_loud_is_cut_off_and_does_not_wrap(mixer):
    for value in (0.9, 0.9):
        mixer.add(tone(value))
    assert (mixer.block() == 32767).all()
    mixer.stop_all()
    mixer.add(tone(-2.0))
    assert (mixer.block() == -32768).all()


def test_a_sound_ends_with_true(mixer):
    sounding = mixer.add(tone(0.5, blocks=1.5))
    mixer.block()
    assert not sounding.done.done()
    assert level(mixer.block()) == pytest.approx(0.25, abs=0.001)  # the rest is silence
    assert sounding.done.result(0) is True


def test_a_stopped_sound_ends_with_false_at_once(mixer):
    sounding = mixer.add(tone(0.5, blocks=9))
    mixer.block()
    mixer.stop(sounding)
    assert sounding.done.result(0) is False
    assert not mixer.block().any()


def test_stopping_what_has_ended_has_no_effect(mixer):
    sounding = mixer.add(tone(0.5, blocks=1))
    mixer.block()
    mixer.stop(sounding)
    assert sounding.done.result(0) is True


def test_of_two_equal_sounds_the_one_meant_is_stopped(mixer):
    one, other = mixer.add(tone(0.5, blocks=5)), mixer.add(tone(0.5, blocks=5))
    mixer.stop(other)
    assert (one.done.done(), other.done.done()) == (False, True)


def test_a_loop_goes_on_until_it_is_stopped(mixer):
    loop = mixer.add(Sounding(numpy.full(BLOCK * 2, 0.5, numpy.float32), 1.0, loop=True))
    assert [level(mixer.block()) for _ in range(9)] == pytest.approx([0.5] * 9, abs=0.001)
    mixer.stop(loop)
    assert loop.done.result(0) is False


def test_an_empty_sound_ends_at_once(mixer):
    empty = mixer.add(Sounding(numpy.zeros(0, numpy.float32), 1.0))
    mixer.block()
    assert empty.done.result(0) is True


def test_a_crowd_is_refused_until_there_is_place(mixer):
    for _ in range(MOST):
        mixer.add(tone(0.0, blocks=1))
    with pytest.raises(CrowdedError, match="cannot play"):
        mixer.add(tone(0.1))
    mixer.block()
    mixer.add(tone(0.1))


def test_stopping_all_stops_each(mixer):
    soundings = [mixer.add(tone(0.1)) for _ in range(3)]
    mixer.stop_all()
    assert [sounding.done.result(0) for sounding in soundings] == [False] * 3


def test_ending_a_listener_twice_does_not_end_another(mixer):
    room, heard = Room(mixer), []
    end = room.listen(heard.append)
    end()
    room.listen(heard.append)
    end()
    assert len(room._listeners) == 1
