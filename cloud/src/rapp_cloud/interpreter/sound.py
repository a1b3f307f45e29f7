"""From a sound file to what the speech model takes: one channel, 16 kHz, float32 within -1..1."""

from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray

from rapp_cloud.interpreter.errors import Invalid

Sound = NDArray[np.float32]

RATE = 16000
"""Samples a second of the speech model."""
_FRAME, _STEP, _TRANSFORM = 400, 160, 512
"""Samples: 25 ms frames every 10 ms, and the size of their transform."""
_FEWEST_FRAMES = 5


def read_sound(recording: Path, longest: float) -> Sound:
    """The recording as 16 kHz mono.

    `longest` in seconds. Raises Invalid when there is no such file, it holds no sound, or it is longer.
    """
    if not recording.is_file():
        raise Invalid(f"cannot interpret {recording.name}: there is no such file; record the command again")
    try:
        with soundfile.SoundFile(recording) as file:
            rate, frames = file.samplerate, file.frames
            if frames > longest * rate:
                raise Invalid(
                    f"cannot interpret {recording.name}: it lasts {frames / rate:.0f} s; "
                    f"record at most {longest:.0f} s of one command"
                )
            samples = file.read(dtype="float32", always_2d=True)
    except soundfile.LibsndfileError as error:
        raise Invalid(f"cannot interpret {recording.name}: it is no sound file ({error}); record it as ogg or wav") from error
    if not len(samples):
        raise Invalid(f"cannot interpret {recording.name}: it holds no sound; record the command again")
    return resample(samples.mean(axis=1), rate)


def resample(samples: Sound, rate: int) -> Sound:
    """`samples` at `rate` (Hz) as 16 kHz, by cutting or padding the spectrum: exact for what both rates can carry."""
    if rate == RATE:
        return samples
    length = max(1, round(len(samples) * RATE / rate))
    spectrum = np.fft.rfft(samples.astype(np.float64))
    kept = min(len(spectrum), length // 2 + 1)
    changed = np.fft.irfft(spectrum[:kept], length) * (length / len(samples))
    return changed.astype(np.float32)


def reduce_noise(samples: Sound, floor: float) -> Sound:
    """Turn down, frame by frame, the frequencies that stand little above the noise (spectral subtraction).

    The noise is the mean of the quietest fifth of the frames (25 ms each, every 10 ms); `floor` is the least gain in
    amplitude, 0..1. A recording too short for that (under 0.1 s) stays as it is.
    """
    count = 1 + (len(samples) - _FRAME) // _STEP
    if count < _FEWEST_FRAMES:
        return samples
    window = np.hanning(_FRAME + 1)[:-1]
    frames = np.lib.stride_tricks.sliding_window_view(samples.astype(np.float64), _FRAME)[::_STEP]
    spectra = np.fft.rfft(frames * window, _TRANSFORM)
    power = np.abs(spectra) ** 2
    quietest = np.argsort(power.sum(axis=1))[: max(_FEWEST_FRAMES, count // 5)]
    gain = np.maximum(1 - power[quietest].mean(axis=0) / np.maximum(power, 1e-12), floor**2)
    before, after = np.vstack([gain[:1], gain[:-1]]), np.vstack([gain[1:], gain[-1:]])
    cleaned = np.fft.irfft(spectra * np.sqrt((before + 2 * gain + after) / 4), _TRANSFORM)[:, :_FRAME] * window
    return _overlap(cleaned, window, len(samples))


def _overlap(frames: NDArray[np.float64], window: NDArray[np.float64], length: int) -> Sound:
    total, weight = np.zeros(length), np.zeros(length)
    for number, frame in enumerate(frames):
        place = slice(number * _STEP, number * _STEP + _FRAME)
        total[place] += frame
        weight[place] += window**2
    return (total / np.maximum(weight, 0.05)).astype(np.float32)
