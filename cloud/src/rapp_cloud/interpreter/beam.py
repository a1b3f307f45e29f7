"""Beam search over a text's pieces, with a bonus for words that are expected (those of the catalogue).

The bonus is what speech recognition calls contextual biasing: each piece that goes on with an expected word adds it,
and a word that is begun but not finished gives it back. So an expected word is preferred to one that sounds alike
("joke" to "jolt"), while sound that is far from every expected word is heard as before.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass
class Expected:
    """Expected words as a tree of piece numbers."""

    following: dict[int, "Expected"] = field(default_factory=dict)
    word: int | None = None
    """Number of the word that ends here, if one does."""


def expect(words: Iterable[Sequence[int]]) -> Expected:
    """The tree of words, each given as its piece numbers."""
    root = Expected()
    for number, word in enumerate(words):
        node = root
        for piece in word:
            node = node.following.setdefault(piece, Expected())
        node.word = number
    return root


@dataclass(frozen=True)
class Row:
    """A text as far as it has been found."""

    pieces: tuple[int, ...]
    score: float
    """ln P(pieces | sound), nats."""
    bonus: float = 0.0
    """Nats for expected words, finished and begun."""
    begun: float = 0.0
    """The part of `bonus` that is given back unless the begun word is finished."""
    place: Expected | None = None
    """Where in the tree the begun word stands; None at its root."""
    found: frozenset[int] = frozenset()
    """The finished expected words; each earns its bonus once, or a text of one repeated word would win."""

    @property
    def worth(self) -> float:
        """What rows are compared by, nats."""
        return self.score + self.bonus


class Beam:
    """Keeps the best `width` unfinished and finished rows."""

    def __init__(self, width: int, start: int, end: int, expected: Expected, bonus: float) -> None:
        self._width, self._end = width, end
        self._expected, self._bonus = expected, bonus
        self._first = np.fromiter(expected.following, np.intp)
        self._open = [Row((start,), 0.0)]
        self._done: list[Row] = []

    def last_pieces(self) -> NDArray[np.int64]:
        """Last piece of each unfinished row, as a column."""
        return np.array([[row.pieces[-1]] for row in self._open], dtype=np.int64)

    def extend(self, chances: NDArray[np.float32]) -> list[int]:
        """Add one piece to each row, given ln P(piece | row); the kept rows' parents, none when the search is over."""
        grown = [
            (self._grow(row, piece, float(chances[parent, piece])), parent)
            for parent, row in enumerate(self._open)
            for piece in self._likely(row, chances[parent])
        ]
        grown.sort(key=lambda item: -item[0].worth)
        finished = [row for row, _ in grown[: 2 * self._width] if row.pieces[-1] == self._end]
        going_on = [item for item in grown if item[0].pieces[-1] != self._end][: self._width]
        self._done = sorted([*self._done, *finished], key=lambda row: -row.worth)[: self._width]
        self._open = [row for row, _ in going_on]
        return [] if self._over() else [parent for _, parent in going_on]

    def best(self) -> list[Row]:
        """The finished rows, best first; the unfinished ones when none has ended."""
        return self._done or self._open

    def _likely(self, row: Row, chances: NDArray[np.float32]) -> set[int]:
        width = min(self._width, len(chances))
        likeliest: set[int] = set(np.argpartition(chances, -width)[-width:].tolist())
        # All that go on with an expected word earn the same, but for words that were found before: of many, the likeliest do.
        most = 2 * self._width + len(row.found)
        following = np.fromiter(row.place.following, np.intp) if row.place else self._first[:0]
        return likeliest | _likeliest(self._first, chances, most) | _likeliest(following, chances, most)

    def _grow(self, row: Row, piece: int, chance: float) -> Row:
        node = row.place.following.get(piece) if row.place else None
        kept = row.bonus if node else row.bonus - row.begun
        begun = row.begun if node else 0.0
        node = node or self._expected.following.get(piece)
        pieces, score = (*row.pieces, piece), row.score + chance
        if not node:
            return Row(pieces, score, kept, found=row.found)
        found, begun, bonus = row.found, begun + self._bonus, kept + self._bonus
        if node.word in found:
            begun, bonus = 0.0, bonus - begun
        elif node.word is not None:
            found, begun = found | {node.word}, 0.0
        place = node if node.following else None
        return Row(pieces, score, bonus, begun, place, found)

    def _over(self) -> bool:
        if not self._open:
            return True
        # a row's worth can still rise by expected words, so wait until it is clearly behind
        return len(self._done) == self._width and self._open[0].worth + 2 * self._bonus < self._done[-1].worth


def _likeliest(pieces: NDArray[np.intp], chances: NDArray[np.float32], most: int) -> set[int]:
    if len(pieces) > most:
        pieces = pieces[np.argpartition(chances[pieces], -most)[-most:]]
    return set(pieces.tolist())
