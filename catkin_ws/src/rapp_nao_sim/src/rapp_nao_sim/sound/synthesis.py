"""Speech from espeak-ng, as samples at the room's rate."""

import io
import subprocess
from collections.abc import Mapping
from functools import cache

import numpy as np
import soundfile

from rapp_nao_sim.errors import SimError
from rapp_nao_sim.sound.samples import RATE, Samples, resample

TIMEOUT = 20.0  # s, for one answer of espeak-ng


class VoiceError(SimError):
    """A text cannot be spoken: no such voice, or espeak-ng is not there."""


def speak(text: str, voice: str, speed: int = 150, rate: int = RATE) -> Samples:
    """Synthesise with an espeak-ng voice: `speed` words per minute, `rate` samples a second, full scale 1. Raises VoiceError."""
    made = espeak("--stdout", "-v", voice, "-s", str(speed), "--", text)
    if not made:
        return np.zeros(0, np.float32)
    try:
        samples, own = soundfile.read(io.BytesIO(made), dtype="float64")
    except soundfile.LibsndfileError as error:
        raise VoiceError(f"cannot speak with voice {voice!r}: espeak-ng gave no sound: {error}") from error
    return resample(samples, own, rate)


def espeak(*words: str) -> bytes:
    """What espeak-ng prints; a text among the words must come after "--". Raises VoiceError."""
    try:
        return subprocess.run(["espeak-ng", *words], capture_output=True, timeout=TIMEOUT, check=True).stdout
    except OSError as error:
        raise VoiceError("cannot speak: espeak-ng does not run; install the Debian package espeak-ng") from error
    except subprocess.SubprocessError as error:
        shown = " ".join(words[: words.index("--")] if "--" in words else words)
        raise VoiceError(f"cannot speak: espeak-ng failed with {shown}; known voices are in `espeak-ng --voices`") from error


@cache
def languages() -> dict[str, str]:
    """English name to code of all languages that espeak-ng speaks, such as "Polish" to "pl". Raises VoiceError.

    Of "French (Belgium)" and "French (France)" one is "French" too, as NAOqi names it.
    """
    rows = [line.split() for line in espeak("--voices").decode().splitlines()[1:]]
    return named({row[1]: row[3].replace("_", " ") for row in rows if len(row) > 3})


def named(names: Mapping[str, str]) -> dict[str, str]:
    """Name to code of languages given by code; a name without its region means "xx", else "xx-xx", else the first."""
    codes = {name: code for code, name in names.items()}
    for code in sorted(names, key=_specialty):
        codes.setdefault(names[code].partition(" (")[0], code)
    return codes


def _specialty(code: str) -> int:
    language, _, region = code.partition("-")
    return 0 if not region else 1 if region == language else 2
