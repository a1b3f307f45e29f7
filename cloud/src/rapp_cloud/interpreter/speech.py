"""Speech to text: Moonshine "tiny" (27 million parameters, English, MIT licence) on ONNX Runtime, with an n-best list.

The weights come inside the PyPI wheel `moonshine-voice`; only its files are used, never its code. The encoder turns
the sound into a row of vectors; the decoder predicts the text's pieces one after another. A beam search keeps the
likeliest texts, so that what a listener is unsure of (daughter, doctor) stays visible to the matching.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from rapp_cloud.interpreter.beam import Beam, Expected, Row, expect
from rapp_cloud.interpreter.errors import Bug
from rapp_cloud.interpreter.sound import RATE, Sound
from rapp_cloud.interpreter.tokens import END, START, Vocabulary, read_vocabulary

_LAYERS, _HEADS, _WIDTH = 6, 8, 36
_PIECES_PER_SECOND = 6.5
"""More than anyone speaks; Moonshine's own bound against texts that repeat themselves."""
_SAMPLES_PER_FRAME = 384
"""Of what the encoder gives."""
_WORDS = 100_000
"""Whose pieces are remembered."""
_SHORTEST = RATE // 5
"""Samples; a word takes longer, and the encoder needs about a third of it."""

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Heard:
    """One possible text of a recording."""

    text: str
    score: float
    """ln P(text | sound), nats."""
    bonus: float
    """What was added for expected words, nats."""
    pieces: int
    """Number of pieces that `score` is the sum of, the end mark included."""


def model_folder() -> Path:
    """The folder with the weights inside the installed wheel; raises Bug when it is not there."""
    spec = find_spec("moonshine_voice")
    if spec is None or spec.origin is None:
        raise Bug("cannot find the speech model: install moonshine-voice 0.0.59 (./rapp does it)")
    folder = Path(spec.origin).parent / "assets" / "tiny-en"
    if not (folder / "encoder_model.ort").is_file():
        raise Bug("cannot find the weights in moonshine-voice: 0.1.5 leaves them out, install 0.0.59")
    return folder


class Recogniser:
    """Holds the loaded model; one per process. Uses one thread, so that workers do not get in each other's way."""

    def __init__(self, folder: Path) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        options.inter_op_num_threads = 1
        options.log_severity_level = 3
        providers = ["CPUExecutionProvider"]
        self._encoder = onnxruntime.InferenceSession(str(folder / "encoder_model.ort"), options, providers=providers)
        self._decoder = onnxruntime.InferenceSession(str(folder / "decoder_model_merged.ort"), options, providers=providers)
        self._vocabulary: Vocabulary = read_vocabulary(folder / "tokenizer.bin")
        self._numbers = lru_cache(maxsize=_WORDS)(self._vocabulary.numbers)
        self._past_names = [
            f"past_key_values.{layer}.{side}.{part}"
            for layer in range(_LAYERS)
            for side in ("decoder", "encoder")
            for part in ("key", "value")
        ]

    def listen(self, sound: Sound, beam: int, expected: Expected, bonus: float) -> tuple[Heard, ...]:
        """The likeliest texts of a 16 kHz sound, best first, at most `beam`; `bonus` nats a piece for `expected` words."""
        if len(sound) < _SHORTEST:
            return ()
        longest = max(8, int(len(sound) / RATE * _PIECES_PER_SECOND))
        search = Beam(beam, START, END, expected, bonus)
        encoded = self._encode(sound)
        past = self._nothing_past(1)
        for step in range(longest):
            logits, past = self._decode(search.last_pieces(), encoded, past, cached=step > 0)
            parents = search.extend(_log_softmax(logits[:, -1]))
            if not parents:
                break
            past = {name: value[parents] for name, value in past.items()}
        return tuple(self._heard(row) for row in search.best())

    def expect(self, words: Iterable[str]) -> Expected:
        """The tree of expected words, each also as a sentence's first word."""
        return expect(self._numbers(form) for word in words for form in (word, word.capitalize()))

    def _encode(self, sound: Sound) -> Floats:
        row = sound[np.newaxis, :].astype(np.float32)
        mask = np.ones(row.shape, dtype=np.int64)
        encoded: Floats = self._encoder.run(None, {"input_values": row, "attention_mask": mask})[0]
        return encoded

    def _decode(
        self, rows: NDArray[np.int64], encoded: Floats, past: dict[str, Floats], cached: bool
    ) -> tuple[Floats, dict[str, Floats]]:
        batch = len(rows)
        hidden = np.repeat(encoded, batch, axis=0)
        mask = (batch, hidden.shape[1] * _SAMPLES_PER_FRAME)  # of samples: the model takes every 384th itself
        feed: dict[str, Any] = {
            "input_ids": rows,
            "encoder_hidden_states": hidden,
            "encoder_attention_mask": np.ones(mask, dtype=np.int64),
            "use_cache_branch": np.array([cached]),
            **past,
        }
        logits, *present = self._decoder.run(None, feed)
        # the cached branch gives empty tensors for the encoder's side: the first step's stay valid
        following = {
            name: past[name] if cached and ".encoder." in name else value
            for name, value in zip(self._past_names, present, strict=True)
        }
        return logits, following

    def _nothing_past(self, batch: int) -> dict[str, Floats]:
        return {name: np.zeros((batch, _HEADS, 0, _WIDTH), dtype=np.float32) for name in self._past_names}

    def _heard(self, row: Row) -> Heard:
        return Heard(self._vocabulary.text(row.pieces), row.score, row.bonus, len(row.pieces) - 1)


def _log_softmax(logits: Floats) -> Floats:
    shifted = logits - logits.max(axis=-1, keepdims=True)
    result: Floats = shifted - np.log(np.exp(shifted).sum(axis=-1, keepdims=True))
    return result
