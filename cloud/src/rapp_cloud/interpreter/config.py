"""Settings of the interpreter, with their units and where the numbers come from.

"Development set" is that of tests/benchmarks/interpret_sentences.json (8 RApps, 48 commands, 36 foreign sentences,
3 voices, 0 to 20 dB of pink noise); the judging set was never used for choosing.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class InterpreterConfig:
    """All numbers of the interpreter."""

    longest_recording: float = 30.0
    """seconds; Moonshine was trained on pieces of at most 30 s."""
    spectral_floor: float = 0.5
    """Least gain (amplitude, 0..1) of noise reduction. Word error rate on the development set at 20 / 5 / 0 dB:
    .18 / .40 / .61 without, .16 / .36 / .62 with .5; stronger (.1) is worse at 0 dB."""
    beam: int = 6
    """Texts kept while decoding and matched afterwards."""
    word_bonus: float = 1.5
    """Nats a piece for words of the catalogue. Commands right on the development set at 1 % wrong answers: .58 with 0,
    .71 with 1, .74 with 1.5, .76 with 2 (but more are pulled to a wrong RApp than with 1.5), .59 with 3."""
    sentences_compared: int = 2
    """A RApp is judged by the mean of its so many nearest sentences. Right at 1.5 % wrong, without bonus: .52 with one,
    .63 with two, .60 with four."""
    word_weight: float = 0.3
    """Weight of shared rare words beside the nearness of meaning: .72 with 0.1, .74 with 0.3 and .75 with 0.4."""
    nearness_weight: float = 16.2
    """Logistic regression on the development set: weight of the best RApp's nearness,"""
    margin_weight: float = 2.2
    """of its distance to the second RApp,"""
    offset: float = -8.7
    """and the constant."""
    threshold: float = 0.75
    """Confidence from which a RApp is named. 1 % wrong on the development set (cross-validated); below it: None."""
    close: float = 0.15
    """RApps above the threshold whose nearness is so little below the best are asked about. None of the development set's
    commands and foreign sentences is asked about up to 0.3; "tell me the time and say hello to me" is 0.12 apart."""
    most_asked: int = 3
    """RApps of one question."""
    most_candidates: int = 50
    """RApps of one answer; it goes to the robot whole."""
