"""Word spotting: what is said to which vocabulary, how answers are counted, how weights are fitted (no sound here)."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rapp_nao_sim.speech.recogniser import SHORTEST, Evidence

SIZES = (4, 10, 40)  # words in the vocabulary
CLEAN = 99  # dB: nothing but the quiet room


@dataclass(frozen=True)
class Case:
    """One word said by one voice in some noise (dB, speech to noise); `known` when it is of the vocabulary listened for."""

    word: str
    known: bool
    voice: str
    noise: int
    size: int
    group: int  # which part of the words is the vocabulary


@dataclass(frozen=True)
class Answer:
    """What came of a case; `noticed` when a sound was; `bare` is the phrase of a plain grammar, which rejects nothing."""

    case: Case
    noticed: bool
    found: Evidence | None
    bare: str | None


Weights = tuple[float, float, float, float]
Probability = Callable[[Evidence, int], float]
"""Of evidence, and of the number of phrases in the vocabulary."""


def groups(words: Sequence[str], size: int) -> list[list[str]]:
    """The words split into whole vocabularies of one size."""
    return [list(words[i : i + size]) for i in range(0, len(words) - size + 1, size)]


def cases(words: Sequence[str], outside: Sequence[str], voices: Sequence[str], noises: Sequence[int]) -> list[Case]:
    """Every word in its vocabularies, every word outside in one vocabulary of each size."""
    found = []
    for size in SIZES:
        parts = groups(words, size)
        said = [(word, True, number) for number, part in enumerate(parts) for word in part]
        said += [(word, False, number % len(parts)) for number, word in enumerate(outside)]
        found += [Case(w, known, v, noise, size, part) for w, known, part in said for v in voices for noise in noises]
    return found


@dataclass(frozen=True)
class Rates:
    """Shares, 0 to 1: of words of the vocabulary, and of words outside."""

    right: float
    wrong: float
    unnoticed: float
    false: float  # words outside that are taken for one of the vocabulary
    bare_right: float
    bare_false: float


def rates(answers: Iterable[Answer], probability: Probability, threshold: float) -> Rates:
    """Count: a word is accepted at or above the threshold."""
    answers = list(answers)
    known, outside = [a for a in answers if a.case.known], [a for a in answers if not a.case.known]

    def accepted(answer: Answer) -> str | None:
        found = answer.found
        return found.phrase if found is not None and probability(found, answer.case.size) >= threshold else None

    return Rates(
        right=_share(accepted(a) == a.case.word for a in known),
        wrong=_share(accepted(a) not in (None, a.case.word) for a in known),
        unnoticed=_share(not a.noticed for a in known),
        false=_share(accepted(a) is not None for a in outside),
        bare_right=_share(a.bare == a.case.word for a in known),
        bare_false=_share(a.bare is not None for a in outside),
    )


def _share(hits: Iterable[bool]) -> float:
    hits = list(hits)
    return sum(hits) / len(hits) if hits else math.nan


def features(found: Evidence, size: int) -> tuple[float, float, float, float]:
    """What the weights weigh, as `recogniser.probability` does."""
    return found.ratio / 50, max(found.frames, SHORTEST) / 50, math.log(size), 1.0


def fit(answers: Iterable[Answer]) -> Weights:
    """Logistic regression (Newton's method) of "the phrase was said" on the evidence."""
    heard = [(a, a.found) for a in answers if a.found is not None]
    rows = np.array([features(found, a.case.size) for a, found in heard])
    said = np.array([float(a.case.known and found.phrase == a.case.word) for a, found in heard])
    weights: NDArray[np.float64] = np.zeros(4)
    for _ in range(100):
        chance = 1 / (1 + np.exp(-np.clip(rows @ weights, -30, 30)))
        curvature = (rows * (chance * (1 - chance))[:, None]).T @ rows + 1e-3 * np.eye(4)
        step = np.linalg.solve(curvature, rows.T @ (said - chance) - 1e-3 * weights)
        weights += step
        if np.abs(step).max() < 1e-9:
            break
    return tuple(float(weight) for weight in weights)  # type: ignore[return-value]


def shifted(weights: Weights, answers: Iterable[Answer], threshold: float, allowed: float) -> Weights:
    """The weights with the least constant taken off so that at most `allowed` of the words outside reach the threshold."""
    outside = [a for a in answers if not a.case.known]
    sums = [_sum(weights, a) for a in outside if a.found is not None]
    let_in = math.floor(allowed * len(outside))
    highest = sorted(sums, reverse=True)
    limit = highest[let_in] if let_in < len(highest) else -math.inf
    wanted = math.log(threshold / (1 - threshold))
    return (*weights[:3], weights[3] - (limit - wanted) - 1e-6) if limit > -math.inf else weights


def _sum(weights: Weights, answer: Answer) -> float:
    assert answer.found is not None
    return sum(w * x for w, x in zip(weights, features(answer.found, answer.case.size), strict=True))
