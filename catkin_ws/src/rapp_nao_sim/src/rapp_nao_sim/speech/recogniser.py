"""Recognition of one spoken word or phrase out of a vocabulary, with a probability and so with rejection of other words.

The probability is a logistic function of the likelihood ratio between the vocabulary's grammar and a free phone loop: a word
that is not in the vocabulary is explained better by the loop. The more phrases there are, the more often one fits by chance, and
the lower the grammar's own scores are; so their number counts too. The weights are a logistic regression on 40 words of and 70
outside the vocabulary, 3 voices, 5 noise levels; their constant lets 6 % of these words outside, and 2.5 % of others, reach 0.4.
"""

import functools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pocketsphinx import Decoder, get_model_path

from rapp_nao_sim.errors import SimError
from rapp_nao_sim.sound.room import Block
from rapp_nao_sim.sound.samples import RATE
from rapp_nao_sim.speech.pronunciation import pronounce
from rapp_nao_sim.speech.words import spoken_words

WEIGHTS = (1.514, 2.722, 0.759, -4.502)  # of ratio, frames, ln(phrases), and 1; from `./rapp bench speech --part development`
LANGUAGE_WEIGHT = 1.0  # pocketsphinx's default of 6.5 spoils the ratio
SCALE = 1024.0  # of pocketsphinx's scores, which are log likelihoods shifted by 10 bits
SHORTEST = 8  # frames of 10 ms; anything shorter counts as this long
FILLERS = frozenset(("SIL", "<sil>", "[NOISE]", "[SPEECH]", "+NSN+", "+SPN+", "(NULL)", "NULL"))
PAD = 0.2  # s of noise around the sound: the decoder's front end has to settle


class VocabularyError(SimError):
    """A phrase of the vocabulary cannot be heard."""


@dataclass(frozen=True)
class Evidence:
    """How much a sound is like a phrase: log likelihood ratio (nats) between it and the phone loop, its frames of 10 ms."""

    phrase: str
    ratio: float
    frames: int


class Recogniser:
    """One vocabulary at a time; words outside the dictionary get their pronunciation from espeak-ng."""

    def __init__(self) -> None:
        self._decoder = Decoder(samprate=RATE, lm=None, lw=LANGUAGE_WEIGHT, loglevel="FATAL")
        self._decoder.add_allphone_file("phones", get_model_path("en-us/en-us-phone.lm.bin"))
        self._phrases: dict[tuple[str, ...], str] = {}

    def set_vocabulary(self, phrases: Sequence[str]) -> None:
        """Listen for these phrases from now on; answers use the caller's spelling. Raises VocabularyError, VoiceError."""
        spoken = {tuple(spoken_words(phrase)): phrase for phrase in phrases}
        if () in spoken:
            raise VocabularyError(f"cannot learn to hear {spoken[()]!r}: there is no word in it")
        for word in {word for words in spoken for word in words}:
            self._learn(word)
        self._phrases = spoken
        if spoken:
            alternatives = " | ".join(" ".join(words) for words in spoken)
            self._decoder.add_jsgf_string("words", f"#JSGF V1.0; grammar g; public <w> = {alternatives} ;")

    def recognise(self, samples: Block) -> list[tuple[str, float]]:
        """Best phrase and its probability; some phrase with none when the sound is like no phrase at all."""
        if not self._phrases:
            return []
        found = self.compare(samples)
        if found is None:
            return [(next(iter(self._phrases.values())), 0.0)]  # so that whoever waits knows that it was no phrase
        return [(found.phrase, probability(found.ratio, found.frames, len(self._phrases)))]

    def compare(self, samples: Block) -> Evidence | None:
        """What speaks for the best phrase; None when there is none."""
        noise = np.random.default_rng(1).normal(0, max(1.0, noise_floor(samples)), round(PAD * RATE))
        padding = np.clip(noise, -32768, 32767).astype(np.int16)
        sound = np.concatenate([padding, samples, padding]).tobytes()
        words, ratio_words, frames = self._decode("words", sound)
        phrase = self._phrases.get(tuple(words.lower().split())) if words is not None else None
        if phrase is None:
            return None
        _, ratio_phones, _ = self._decode("phones", sound)
        return Evidence(phrase, ratio_words - ratio_phones, frames)

    def _decode(self, search: str, sound: bytes) -> tuple[str | None, float, int]:
        decoder = self._decoder
        decoder.activate_search(search)
        decoder.start_utt()
        decoder.process_raw(sound, full_utt=True)
        decoder.end_utt()
        hypothesis = decoder.hyp()
        if hypothesis is None or hypothesis.score <= 0:
            return None, -math.inf, 0
        frames = sum(s.end_frame - s.start_frame + 1 for s in decoder.seg() or () if s.word not in FILLERS)
        return re.sub(r"\(\d+\)", "", hypothesis.hypstr), SCALE * math.log(hypothesis.score), frames

    @functools.cache  # noqa: B019 - one recogniser lives as long as its process
    def _learn(self, word: str) -> None:
        if self._decoder.lookup_word(word) is None:
            phones = pronounce(word)
            if not phones:
                raise VocabularyError(f"cannot learn to hear {word!r}: espeak-ng gives no pronunciation")
            self._decoder.add_word(word, phones, True)


def noise_floor(samples: Block) -> float:
    """Noise floor of a sound: the level of its quietest tenth."""
    blocks = samples[: len(samples) // 160 * 160].reshape(-1, 160).astype(np.float64)
    levels = np.sqrt((blocks**2).mean(axis=1)) if len(blocks) else np.ones(1)
    return float(np.quantile(levels, 0.1))


def probability(ratio: float, frames: int, phrases: int) -> float:
    """That a phrase was said, from the evidence for it (see `Evidence`) and the number of phrases that it could have been."""
    features = (ratio / 50, max(frames, SHORTEST) / 50, math.log(max(phrases, 1)), 1.0)
    x = sum(weight * feature for weight, feature in zip(WEIGHTS, features, strict=True))
    return 1 / (1 + math.exp(-max(-50.0, min(50.0, x))))
