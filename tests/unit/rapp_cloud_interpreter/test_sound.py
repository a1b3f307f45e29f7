"""Sound files as the speech model takes them."""

import numpy as np
import pytest
import soundfile

from rapp_cloud.interpreter.errors import Invalid
from rapp_cloud.interpreter.sound import RATE, read_sound, reduce_noise, resample


def tone(frequency, rate, seconds=1.0):
    return np.sin(2 * np.pi * frequency * np.arange(int(rate * seconds)) / rate).astype(np.float32)


def loudest_frequency(samples, rate=RATE):
    spectrum = np.abs(np.fft.rfft(samples))
    return np.fft.rfftfreq(len(samples), 1 / rate)[spectrum.argmax()]


@pytest.mark.parametrize("rate", [8000, 16000, 22050, 44100, 48000])
def test_resampled_tone_keeps_pitch_length_and_level(rate):
    samples = resample(tone(1000, rate), rate)
    assert len(samples) == RATE
    assert loudest_frequency(samples) == pytest.approx(1000, abs=1)
    assert np.sqrt(np.mean(samples**2)) == pytest.approx(np.sqrt(0.5), rel=0.02)


def test_what_16_khz_cannot_carry_is_removed():
    assert np.abs(resample(tone(11000, 48000), 48000)).max() < 0.01


@pytest.mark.parametrize(("form", "subtype"), [("WAV", "PCM_16"), ("OGG", "VORBIS")])
def test_reads_four_channels_at_48_khz(tmp_path, form, subtype):
    file = tmp_path / "command"
    soundfile.write(file, np.stack([0.5 * tone(500, 48000)] * 4, axis=1), 48000, format=form, subtype=subtype)
    samples = read_sound(file, longest=5)
    assert samples.dtype == np.float32
    assert len(samples) == RATE
    assert loudest_frequency(samples) == pytest.approx(500, abs=1)


def test_missing_file_says_record_again(tmp_path):
    with pytest.raises(Invalid, match=r"^cannot interpret away\.ogg: .*record the command again$"):
        read_sound(tmp_path / "away.ogg", longest=5)


def test_text_file_says_record_as_sound(tmp_path):
    file = tmp_path / "note.ogg"
    file.write_text("what time is it")
    with pytest.raises(Invalid, match=r"^cannot interpret note\.ogg: it is no sound file .*record it as ogg or wav$"):
        read_sound(file, longest=5)


def test_empty_sound_says_record_again(tmp_path):
    file = tmp_path / "empty.wav"
    soundfile.write(file, np.zeros(0), RATE)
    with pytest.raises(Invalid, match=r"holds no sound; record the command again$"):
        read_sound(file, longest=5)


def test_long_sound_says_how_long_it_may_be(tmp_path):
    file = tmp_path / "long.wav"
    soundfile.write(file, np.zeros(3 * RATE), RATE)
    with pytest.raises(Invalid, match=r"lasts 3 s; record at most 2 s"):
        read_sound(file, longest=2)
    assert len(read_sound(file, longest=3)) == 3 * RATE


def test_noise_falls_by_more_than_speech():
    noise = 0.05 * np.random.default_rng(1).standard_normal(2 * RATE).astype(np.float32)
    sound = noise.copy()
    sound[RATE : RATE + RATE // 2] += tone(800, RATE, 0.5)
    cleaned = reduce_noise(sound, floor=0.3)

    def level(samples):
        return float(np.sqrt(np.mean(samples**2)))

    assert level(cleaned[: RATE // 2]) < 0.7 * level(sound[: RATE // 2])
    burst = slice(RATE + 2000, RATE + 6000)
    assert level(cleaned[burst]) > 0.95 * level(sound[burst])


@pytest.mark.parametrize("count", [1, 399, 900])
def test_shortest_sounds_pass_unchanged(count):
    samples = np.ones(count, dtype=np.float32)
    assert reduce_noise(samples, floor=0.5) is samples
