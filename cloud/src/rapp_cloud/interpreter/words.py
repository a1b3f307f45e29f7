"""Words of sentences: plain form, content words, and how rare each is in a catalogue (pure)."""

import math
import re
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
        users: dict[str, int] = {}
        for sentences in commands.values():
            for word in {word for text in sentences for word in plain(text).split()}:
                users[word] = users.get(word, 0) + 1
        self._weights = {word: math.log((len(commands) + 1) / count) for word, count in users.items()}
        self._places = {word: place for place, word in enumerate(sorted(users))}

    def vector(self, text: str) -> NDArray[np.float64]:
        """A vector of length 1 (0 for a text without weight); its last place stands for words outside the catalogue."""
        vector = np.zeros(len(self._places) + 1)
        words = plain(text).split()
        for word in set(words) & self._places.keys():
            vector[self._places[word]] = self._weights[word]
        strange = sum(word not in self._places for word in words)
        vector[-1] = _STRANGE_WORD * math.sqrt(strange)
        return vector / max(float(np.linalg.norm(vector)), 1e-9)
