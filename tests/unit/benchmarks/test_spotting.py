"""Counting and fitting of word spotting, on made-up evidence."""

import math

import pytest

from benchmarks.spotting import Answer, Case, cases, fit, groups, rates, shifted
from rapp_nao_sim.speech.recogniser import Evidence

WORDS = [f"word{number}" for number in range(40)]


def answer(said: str, known: bool, heard: str | None, ratio: float = 0.0, noticed: bool = True, bare: str | None = None) -> Answer:
    case = Case(said, known, "en-us+m3", 20, 4, 0)
    return Answer(case, noticed, Evidence(heard, ratio, 50) if heard else None, bare)


def by_sign(found: Evidence, _size: int) -> float:
    return 1.0 if found.ratio > 0 else 0.0


def test_groups_are_whole_vocabularies() -> None:
    assert groups("abcdefghij", 4) == [["a", "b", "c", "d"], ["e", "f", "g", "h"]]


def test_every_word_is_said_to_a_vocabulary_that_holds_it_and_outside_words_are_not() -> None:
    said = cases(WORDS, ["outside"] * 3, ["m", "f"], [20, 0])
    assert len(said) == 3 * (40 + 3) * 2 * 2
    for case in said:
        assert (case.word in groups(WORDS, case.size)[case.group]) == case.known


def test_rates_count_each_outcome() -> None:
    answers = [
        answer("a", True, "a", 1.0, bare="a"),
        answer("a", True, "b", 1.0, bare="b"),
        answer("a", True, "a", -1.0, bare="a"),
        answer("a", True, None, noticed=False),
        answer("x", False, "a", 1.0, bare="a"),
        answer("x", False, "a", -1.0, bare="a"),
        answer("x", False, None, bare=None),
    ]
    counted = rates(answers, by_sign, 0.4)
    assert (counted.right, counted.wrong, counted.unnoticed) == (0.25, 0.25, 0.25)
    assert counted.false == pytest.approx(1 / 3)
    assert (counted.bare_right, counted.bare_false) == (0.5, pytest.approx(2 / 3))


def test_without_cases_there_are_no_rates() -> None:
    assert math.isnan(rates([], by_sign, 0.4).right)


def evidence() -> list[Answer]:
    known = [answer("a", True, "a", float(ratio)) for ratio in range(-20, 100)]
    return known + [answer("x", False, "a", float(ratio)) for ratio in range(-100, 20)]


def test_fitted_weights_tell_said_from_not_said() -> None:
    weights = fit(evidence())
    assert weights[0] > 0


@pytest.mark.parametrize("allowed", [0.0, 0.02, 0.1])
def test_shifted_weights_let_in_as_many_as_allowed(allowed: float) -> None:
    answers = evidence()
    weights = shifted(fit(answers), answers, 0.4, allowed)

    def probability(found: Evidence, size: int) -> float:
        x = weights[0] * found.ratio / 50 + weights[1] * found.frames / 50 + weights[2] * math.log(size) + weights[3]
        return 1 / (1 + math.exp(-x))

    let_in = rates(answers, probability, 0.4).false
    assert let_in <= allowed
    assert let_in >= allowed - 1 / 120
    assert rates(answers, probability, 0.4).right > 0.5
