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

Meaning = Callable[[str], NDArray[Any]]
"""A text's vector of length 1."""

Texts = Sequence[tuple[str, float]]
"""(possible text, its probability), best first."""


def match(texts: Texts, commands: Commands, meaning: Meaning, config: InterpreterConfig) -> Interpretation:
    """The RApp that was meant; None when nothing was heard, there is no RApp, the confidence is too low, or several fit."""
    heard = [(plain(text), chance) for text, chance in texts if plain(text)]
    offered = {name: list(sentences) for name, sentences in commands.items() if any(map(plain, sentences))}
    best_text = heard[0][0] if heard else ""
    if not heard or not offered:
        return Interpretation(None, 0.0, best_text, tuple((name, 0.0) for name in sorted(commands)))
    nearness = _nearness(heard, offered, meaning, config)
    ranked = sorted(nearness, key=lambda name: (-nearness[name], name))
    candidates = [(name, _confidence(nearness, name, config)) for name in ranked]
    candidates += [(name, 0.0) for name in sorted(commands.keys() - offered.keys())]
    best, confidence = candidates[0]
    good = [name for name, value in candidates if value >= config.threshold]
    close = [name for name in good if nearness[best] - nearness[name] <= config.close][: config.most_asked]
    named = best if len(close) == 1 else None
    return Interpretation(named, confidence, best_text, tuple(candidates), tuple(close) if len(close) > 1 else ())


def chances(worths: Sequence[float]) -> list[float]:
    """Probabilities, sum 1, of texts with these ln likelihoods (nats)."""
    most = max(worths, default=0.0)
    parts = [math.exp(worth - most) for worth in worths]
    return [part / sum(parts) for part in parts]


def _nearness(heard: Texts, offered: dict[str, list[str]], meaning: Meaning, config: InterpreterConfig) -> dict[str, float]:
    rare = RareWords(offered)
    meant = [(meaning(text), rare.vector(text), chance) for text, chance in heard]
    result = {}
    for name, sentences in offered.items():
        senses = np.stack([meaning(text) for text in sentences])
        words = np.stack([rare.vector(text) for text in sentences])
        result[name] = sum(
            chance * (_mean_of_best(senses @ sense, config) + config.word_weight * float((words @ word).max()))
            for sense, word, chance in meant
        )
    return result


def _mean_of_best(cosines: NDArray[Any], config: InterpreterConfig) -> float:
    return float(np.sort(cosines)[::-1][: config.sentences_compared].mean())


def _confidence(nearness: dict[str, float], name: str, config: InterpreterConfig) -> float:
    rivals = [value for other, value in nearness.items() if other != name]
    # the regression knows margins of the best only: one behind its rival, or without any, gets no margin
    margin = max(0.0, nearness[name] - max(rivals, default=nearness[name]))
    evidence = config.nearness_weight * nearness[name] + config.margin_weight * margin + config.offset
    return 1.0 / (1.0 + math.exp(-evidence))
