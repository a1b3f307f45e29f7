"""Speech from espeak-ng, as samples at the room's rate."""

import io
import subprocess
from functools import cache

import numpy as np
import numpy.typing as npt
import soundfile

RATE = 16_000  # Hz, of everything that sounds in the room
TIMEOUT = 20.0  # s, for one synthesis

Samples = npt.NDArray[np.float32]


class VoiceError(Exception):
    """A text cannot be spoken: no such voice, or espeak-ng is not there."""


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


def speak(text: str, voice: str, speed: int = 150) -> Samples:
    """Synthesise a text with an espeak-ng voice, at `speed` words per minute; full scale is 1. Raises VoiceError."""
    words = ["espeak-ng", "--stdout", "-v", voice, "-s", str(speed), "--", text]
    try:
        made = subprocess.run(words, capture_output=True, timeout=TIMEOUT, check=True)
    except FileNotFoundError as error:
        raise VoiceError("cannot speak: espeak-ng is not installed") from error
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
        raise VoiceError(f"cannot speak with voice {voice!r}: see `espeak-ng --voices`") from error
    if not made.stdout:
        return np.zeros(0, np.float32)
    samples, rate = soundfile.read(io.BytesIO(made.stdout), dtype="float64")
    return resample(samples, rate, RATE)


@cache
def languages() -> dict[str, str]:
    """Language code to English name of all that espeak-ng speaks, such as "pl" to "Polish"."""
    listing = subprocess.run(["espeak-ng", "--voices"], capture_output=True, text=True, timeout=TIMEOUT, check=True).stdout
    rows = [line.split() for line in listing.splitlines()[1:]]
    return {row[1]: row[3].replace("_", " ") for row in rows if len(row) > 3}
