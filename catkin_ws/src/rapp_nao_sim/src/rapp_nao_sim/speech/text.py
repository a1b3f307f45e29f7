"""Recognition of text, for the text-fed microphone: the same answers without sound."""

from collections.abc import Sequence

from rapp_nao_sim.speech.words import spoken_words

REJECTED = 0.05  # probability of the first word of the vocabulary when something else was said


def match(text: str, vocabulary: Sequence[str]) -> list[tuple[str, float]]:
    """The phrase that was said, with probability 1; some phrase with a low one when none of them was."""
    said = spoken_words(text)
    for phrase in vocabulary:
        if spoken_words(phrase) == said:
            return [(phrase, 1.0)]
    return [(vocabulary[0], REJECTED)] if vocabulary and said else []
