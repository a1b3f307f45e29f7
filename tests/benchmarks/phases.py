"""From what the agents publish to the phases of one activation (pure: no process, no clock)."""

import itertools
import re
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

SPEECH_ENDED = "speech has ended"
SOUND_ENDED = "end of sound noticed"
TAKEN = "word recognised, or command recorded"
UNDERSTOOD = "RApp known"
DOWNLOADING = "download begun"
DOWNLOADED = "package downloaded"
VERIFIED = "package verified"
INSTALLED = "package installed"
ACTIVATING = "activation begun"
FIRST_WORD = "agent's first line"
FIRST_CALL = "first core service call"

ORDER = (
    SPEECH_ENDED, SOUND_ENDED, TAKEN, UNDERSTOOD, DOWNLOADING, DOWNLOADED, VERIFIED, INSTALLED, ACTIVATING, FIRST_WORD,
    FIRST_CALL,
)  # fmt: skip
"""Marks on the way, in their order; those of a download are missing when the RApp is installed."""
_PACKAGE_CAME = re.compile(r"repository->link reply GET \S+\.hz( from byte \d+)?")


@dataclass(frozen=True)
class Stamp:
    """One rapp_msgs/AgentState: `at` in s since the epoch; `kind` is its constant's name in lower case."""

    at: float
    agent: str
    state: str
    kind: str
    detail: str


Marks = Mapping[str, float]
"""Mark to s since the epoch."""


def _mark(stamp: Stamp) -> str | None:
    """The mark that a happening is, if any."""
    if stamp.kind == "entered" and stamp.agent == "core":
        return {"s4": TAKEN, "s5": TAKEN, "s6": UNDERSTOOD, "s7": ACTIVATING}.get(stamp.state)
    if stamp.kind != "message":
        return None
    if stamp.detail.startswith("dynamic->core rapp_"):
        return FIRST_CALL
    if _PACKAGE_CAME.fullmatch(stamp.detail):
        return DOWNLOADED
    return {
        "link->core downloading (asynchronous)": DOWNLOADING,
        "link->core verified (asynchronous)": VERIFIED,
        "link->core installed (asynchronous)": INSTALLED,
        "dynamic->core first_word (asynchronous)": FIRST_WORD,
    }.get(stamp.detail)


def marks(speech_ended: float, sound_ends: Iterable[float], stamps: Iterable[Stamp]) -> dict[str, float]:
    """The first of each mark after the end of speech; for the end of sound the last one before the command was taken.

    Raises ValueError when the first service call, or the end of sound, is missing.
    """
    found = {SPEECH_ENDED: speech_ended}
    for stamp in sorted(stamps, key=lambda s: s.at):
        name = _mark(stamp)
        if name is not None and stamp.at >= speech_ended:
            found.setdefault(name, stamp.at)
    before = [at for at in sound_ends if speech_ended <= at <= found.get(TAKEN, 0.0)]
    if not before or FIRST_CALL not in found:
        raise ValueError(f"cannot time the activation: seen are only {', '.join(found)}")
    found[SOUND_ENDED] = max(before)
    return {name: found[name] for name in ORDER if name in found}


def durations(activation: Marks) -> dict[str, float]:
    """Seconds from the mark before to each mark but the first."""
    names = [name for name in ORDER if name in activation]
    return {name: activation[name] - activation[before] for before, name in itertools.pairwise(names)}


def between(activations: Sequence[Marks], begin: str, end: str) -> float:
    """Median seconds from one mark to another."""
    return statistics.median(activation[end] - activation[begin] for activation in activations)


def timeline(activations: Sequence[Marks]) -> dict[str, tuple[float, float]]:
    """Mark to the medians of its duration and of its time since the end of speech, s."""
    names = [name for name in ORDER[1:] if all(name in activation for activation in activations)]
    took = [durations(activation) for activation in activations]
    return {name: (statistics.median(each[name] for each in took), between(activations, SPEECH_ENDED, name)) for name in names}
