"""From possible texts to RApps (pure: the model of meaning is handed in).

For each text and each RApp: the mean cosine of the text's meaning with the RApp's nearest sentences, plus a share for
rare words in common. Averaged over the texts by their probability this is the RApp's nearness; the best nearness and
its distance to the second give the confidence by logistic regression.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rapp_cloud.interpreter.config import InterpreterConfig
from rapp_cloud.interpreter.port import Commands, Interpretation
from rapp_cloud.interpreter.words import RareWords, plain

Meanings = Callable[[Sequence[str]], NDArray[Any]]
"""The texts' vectors of length 1, a row each."""

Texts = Sequence[tuple[str, float]]
"""(possible text, its probability), best first."""


class Offered:
    """A catalogue made ready for texts to be compared with it; worth keeping while it stays the same."""

    def __init__(self, commands: Commands, meanings: Meanings) -> None:
        """Take the meanings of all its sentences."""
        spoken = {name: list(commands[name]) for name in sorted(commands) if any(map(plain, commands[name]))}
        self.names = tuple(spoken)
        self.mute = tuple(sorted(commands.keys() - spoken.keys()))  # RApps that nothing can be said for
        counts = [len(sentences) for sentences in spoken.values()]
        self._counts = np.array(counts)
        self._first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.intp)
        self._owner = np.repeat(np.arange(len(counts)), counts)
        self._rare = RareWords(spoken)
        self._senses = meanings([text for sentences in spoken.values() for text in sentences])

    def nearness(self, heard: Texts, meanings: Meanings, config: InterpreterConfig) -> NDArray[np.float64]:
        """How near what was heard is to each RApp, in the order of `names`."""
        cosines = self._senses @ meanings([text for text, _ in heard]).T
        found = np.zeros(len(self.names))
        for (text, chance), column in zip(heard, cosines.T, strict=True):
            words = np.maximum.reduceat(self._rare.alike(text), self._first)
            found += chance * (self._mean_of_best(column, config.sentences_compared) + config.word_weight * words)
        return found

    def _mean_of_best(self, cosines: NDArray[Any], most: int) -> NDArray[np.float64]:
        order = np.lexsort((-cosines, self._owner))
        rank = np.arange(len(order)) - self._first[self._owner]  # of each among those of its RApp
        sums = np.bincount(self._owner, np.where(rank < most, cosines[order], 0.0), len(self.names))
        means: NDArray[np.float64] = sums / np.minimum(self._counts, most)
        return means


def match(texts: Texts, offered: Offered, meanings: Meanings, config: InterpreterConfig) -> Interpretation:
    """The RApp that was meant; None when nothing was heard, there is no RApp, the confidence is too low, or several fit."""
    heard = [(plain(text), chance) for text, chance in texts if plain(text)]
    best_text = heard[0][0] if heard else ""
    if not heard or not offered.names:
        nothing = sorted(offered.names + offered.mute)[: config.most_candidates]
        return Interpretation(None, 0.0, best_text, tuple((name, 0.0) for name in nothing))
    nearness = offered.nearness(heard, meanings, config)
    ranked = np.argsort(-nearness, kind="stable")[: config.most_candidates + 1]
    best = float(nearness[ranked[0]])
    margin = best - float(nearness[ranked[1]]) if len(ranked) > 1 else 0.0
    # the regression knows margins of the best only: one behind its rival, or without any, gets no margin
    values = [_confidence(float(nearness[place]), 0.0 if number else margin, config) for number, place in enumerate(ranked)]
    names = [offered.names[place] for place in ranked]
    candidates = [*zip(names, values, strict=True), *((name, 0.0) for name in offered.mute)][: config.most_candidates]
    good = [(name, place) for name, place, value in zip(names, ranked, values, strict=True) if value >= config.threshold]
    close = [name for name, place in good if best - nearness[place] <= config.close][: config.most_asked]
    named = names[0] if len(close) == 1 else None
    return Interpretation(named, values[0], best_text, tuple(candidates), tuple(close) if len(close) > 1 else ())


def chances(worths: Sequence[float]) -> list[float]:
    """Probabilities, sum 1, of texts with these ln likelihoods (nats)."""
    most = max(worths, default=0.0)
    parts = [math.exp(worth - most) for worth in worths]
    return [part / sum(parts) for part in parts]


def _confidence(nearness: float, margin: float, config: InterpreterConfig) -> float:
    evidence = config.nearness_weight * nearness + config.margin_weight * margin + config.offset
    return 1.0 / (1.0 + math.exp(-evidence))
