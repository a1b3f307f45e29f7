"""Sounds from files and at other rates."""

import numpy
import pytest
import soundfile

from rapp_nao_sim.sound.samples import RATE, SoundError, load, resample


def sine(frequency, rate, seconds=0.5):
    return numpy.sin(2 * numpy.pi * frequency * numpy.arange(round(rate * seconds)) / rate)


def strongest(samples):
    return numpy.argmax(numpy.abs(numpy.fft.rfft(samples))) * RATE / len(samples)


@pytest.mark.parametrize("rate", [8_000, 22_050, 44_100, 48_000])
def test_a_tone_keeps_its_pitch_length_and_level(rate):
    samples = resample(sine(440, rate), rate, RATE)
    assert len(samples) == pytest.approx(0.5 * RATE, abs=1)
    assert strongest(samples) == pytest.approx(440, abs=2)
    assert numpy.abs(samples[1000:-1000]).max() == pytest.approx(1.0, abs=0.05)


def test_what_the_rate_cannot_hold_is_left_out():
    assert numpy.abs(resample(sine(11_000, 48_000), 48_000, RATE)[500:-500]).max() < 0.02


def test_the_same_rate_and_nothing_stay_as_they_are():
    samples = sine(100, RATE)
    assert resample(samples, RATE, RATE) == pytest.approx(samples, abs=1e-6)
    assert len(resample(numpy.zeros(0), 8_000, RATE)) == 0


def test_a_file_of_two_channels_and_another_rate(tmp_path):
    left, right = sine(440, 44_100) * 0.8, numpy.zeros(22_050)
    soundfile.write(tmp_path / "two.wav", numpy.stack([left, right], axis=1), 44_100)
    samples = load(tmp_path / "two.wav")
    assert strongest(samples) == pytest.approx(440, abs=2)
    assert numpy.abs(samples[1000:-1000]).max() == pytest.approx(0.4, abs=0.03)


@pytest.mark.parametrize("content", [None, b"", b"OggS but no more", b"\0" * 5000])
def test_what_is_no_sound_file_is_an_error(tmp_path, content):
    path = tmp_path / "broken.ogg"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SoundError, match=r"cannot play .*broken\.ogg"):
        load(path)


def test_a_folder_is_no_sound_file(tmp_path):
    with pytest.raises(SoundError):
        load(tmp_path)
