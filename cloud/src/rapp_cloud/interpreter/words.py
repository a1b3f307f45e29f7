"""Words of sentences: plain form, content words, and how rare each is in a catalogue (pure)."""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

_FUNCTION_WORDS = (
    "a an the i i'm me my you your we us our he she it its they them this that these those is are am was were be been "
    "being do does did have has had will would shall should can could may might must to of in on at by for with from "
    "about as into out up off and or but if so not no yes what which who whom whose when where why how there here then "
    "than too very some any all something anything everything somebody please like want let more again now"
)
FUNCTION_WORDS = frozenset(_FUNCTION_WORDS.split())
"""English words that are in every RApp's sentences and say nothing of which."""

_STRANGE_WORD = 1.2
"""Weight of a word that no sentence of the catalogue has: about that of one that three RApps of ten share."""
_NOTHING = 1e-9
"""Length of a vector that has none."""


def plain(text: str) -> str:
    """Lower-case letters, apostrophes and single blanks; "e-mail" is "email", as the speech model writes it."""
    joined = re.sub(r"\be[- ]mail", "email", text.lower())
    return " ".join(re.findall(r"[a-z']+", joined))


def content_words(sentences: Sequence[str]) -> list[str]:
    """The words of sentences that say something of their subject, sorted, each once."""
    return sorted({word for text in sentences for word in plain(text).split()} - FUNCTION_WORDS)


class RareWords:
    """Sentences as vectors of word weights: ln of how few RApps use a word (inverse document frequency)."""

    def __init__(self, commands: Mapping[str, Sequence[str]]) -> None:
        """Weigh the words of these; their sentences are numbered in order."""
        spoken = {name: [set(plain(text).split()) for text in sentences] for name, sentences in commands.items()}
        users = Counter(word for each in spoken.values() for word in set().union(*each))
        self._places = {word: place for place, word in enumerate(sorted(users))}
        self._weights = np.array([math.log((len(commands) + 1) / users[word]) for word in self._places])
        rows = [words for each in spoken.values() for words in each]
        self._count = len(rows)
        self._rows = np.repeat(np.arange(len(rows)), [len(words) for words in rows])
        self._columns = np.array([self._places[word] for words in rows for word in words], dtype=np.intp)
        weights = self._weights[self._columns]
        lengths = np.sqrt(np.bincount(self._rows, weights**2, self._count))
        self._values = weights / np.maximum(lengths, _NOTHING)[self._rows]

    def vector(self, text: str) -> NDArray[np.float64]:
        """A vector of length 1 (0 for a text without weight); its last place stands for words outside the catalogue."""
        vector = np.zeros(len(self._places) + 1)
        words = plain(text).split()
        known = [self._places[word] for word in set(words) & self._places.keys()]
        vector[known] = self._weights[known]
        strange = sum(word not in self._places for word in words)
        vector[-1] = _STRANGE_WORD * math.sqrt(strange)
        return vector / max(float(np.linalg.norm(vector)), _NOTHING)

    def alike(self, text: str) -> NDArray[np.float64]:
        """How alike a text is to each sentence, 0..1: the products of their vectors."""
        shares = self._values * self.vector(text)[self._columns]
        return np.bincount(self._rows, shares, self._count).astype(np.float64, copy=False)
