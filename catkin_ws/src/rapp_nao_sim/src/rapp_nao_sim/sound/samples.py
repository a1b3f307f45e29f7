"""Sound as numbers: one channel of samples at the room's rate, from files and from other rates."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import soundfile

from rapp_nao_sim.errors import SimError

RATE = 16_000  # Hz, of everything that sounds in the room

Samples = npt.NDArray[np.float32]


class SoundError(SimError):
    """A sound file cannot be read."""


def load(path: Path) -> Samples:
    """Read a sound file of any rate and number of channels; full scale is 1. Raises SoundError."""
    if not path.is_file():
        raise SoundError(f"cannot play {path}: there is no such file")
    try:
        samples, rate = soundfile.read(path, dtype="float64", always_2d=True)
    except (soundfile.LibsndfileError, OSError) as error:
        raise SoundError(f"cannot play {path}: it is no sound file that can be read: {error}") from error
    return resample(samples.mean(axis=1), rate, RATE)


def resample(samples: npt.NDArray[np.float64], rate: float, target: float) -> Samples:
    """Windowed-sinc resampling of one channel from `rate` to `target` Hz."""
    if rate == target or not len(samples):
        return samples.astype(np.float32)
    count = round(len(samples) * target / rate)
    cutoff = min(1.0, target / rate) * 0.97
    half = 24
    position = np.arange(count) * rate / target
    first = np.floor(position).astype(int)
    taps = np.arange(-half + 1, half + 1)
    distance = position[:, None] - (first[:, None] + taps[None, :])
    window = 0.54 + 0.46 * np.cos(np.pi * np.clip(distance / half, -1, 1))
    padded = np.pad(samples, (half, half + 1))
    index = np.clip(first[:, None] + taps[None, :] + half, 0, len(padded) - 1)
    result: Samples = (padded[index] * cutoff * np.sinc(cutoff * distance) * window).sum(1).astype(np.float32)
    return result
