"""Texts to RApps, with a meaning of our own: bags of words."""

from dataclasses import replace

import numpy as np
import pytest

from rapp_cloud.interpreter.config import InterpreterConfig
from rapp_cloud.interpreter.matching import Offered, chances, match
from rapp_cloud.interpreter.words import plain

COMMANDS = {
    "voice_mail": ["send a message to my daughter", "write a letter to somebody"],
    "clock": ["what time is it", "tell me the time"],
    "weather": ["will it rain tomorrow", "tell me the weather"],
}
CONFIG = InterpreterConfig()


def bags(texts):
    """Words hashed to 64 places, so that texts with the same words are near."""
    vectors = np.zeros((len(texts), 64))
    for vector, text in zip(vectors, texts, strict=True):
        for word in plain(text).split():
            vector[sum(map(ord, word)) % 64] += 1
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9)


def meant(*texts, commands=COMMANDS, config=CONFIG):
    return match([(text, 1 / len(texts)) for text in texts], Offered(commands, bags), bags, config)


@pytest.mark.parametrize("name", COMMANDS)
def test_own_sentence_names_its_rapp(name):
    found = meant(COMMANDS[name][0], config=replace(CONFIG, sentences_compared=1))
    assert found.rapp == name
    assert found.confidence >= CONFIG.threshold
    assert found.candidates[0] == (name, found.confidence)


def test_strange_sentence_names_none():
    found = meant("frozen rivers carry heavy ships")
    assert found.rapp is None
    assert found.confidence < CONFIG.threshold
    assert found.text == "frozen rivers carry heavy ships"


def test_threshold_decides():
    text = "what time is it"
    confidence = meant(text).confidence
    assert meant(text, config=replace(CONFIG, threshold=confidence)).rapp == "clock"
    assert meant(text, config=replace(CONFIG, threshold=confidence + 0.001)).rapp is None


def test_candidates_hold_every_rapp_once_best_first():
    found = meant("tell me the weather")
    values = [confidence for _, confidence in found.candidates]
    assert sorted(name for name, _ in found.candidates) == sorted(COMMANDS)
    assert values == sorted(values, reverse=True)
    assert all(0 <= value <= 1 for value in values)


def test_unsure_text_lowers_the_confidence():
    assert meant("what time is it", "frozen ships").confidence < meant("what time is it").confidence


def test_two_rapps_with_the_same_sentences_are_doubted():
    twins = {**COMMANDS, "watch": COMMANDS["clock"]}
    assert meant("what time is it", commands=twins).confidence < meant("what time is it").confidence


def test_rapps_that_fit_alike_are_asked_about_and_none_is_named():
    twins = {**COMMANDS, "watch": COMMANDS["clock"]}
    found = meant("what time is it", commands=twins, config=replace(CONFIG, sentences_compared=1))
    assert (found.rapp, found.choice) == (None, ("clock", "watch"))
    assert found.confidence >= CONFIG.threshold


def test_not_more_than_three_are_asked_about():
    many = dict.fromkeys(("clock", "watch", "hourglass", "sundial"), COMMANDS["clock"])
    assert len(meant("what time is it", commands=many, config=replace(CONFIG, sentences_compared=1)).choice) == 3


def test_nothing_is_asked_below_the_threshold_nor_about_one():
    twins = {**COMMANDS, "watch": COMMANDS["clock"]}
    assert meant("frozen rivers carry heavy ships", commands=twins).choice == ()
    assert meant("what time is it", config=replace(CONFIG, sentences_compared=1)).choice == ()


def test_rapp_without_rival_gets_no_margin_for_it():
    alone = {"clock": COMMANDS["clock"]}
    assert meant("what time is it", commands=alone).confidence < meant("what time is it").confidence
    assert meant("frozen rivers carry heavy ships", commands=alone).rapp is None


def test_likelier_text_decides():
    texts = [("what time is it", 0.9), ("will it rain tomorrow", 0.1)]
    assert match(texts, Offered(COMMANDS, bags), bags, CONFIG).candidates[0][0] == "clock"
    assert match([(t, 1 - p) for t, p in texts], Offered(COMMANDS, bags), bags, CONFIG).candidates[0][0] == "weather"


@pytest.mark.parametrize("texts", [[], [("", 1.0)], [("...", 1.0)]])
def test_nothing_heard_names_none(texts):
    found = match(texts, Offered(COMMANDS, bags), bags, CONFIG)
    assert (found.rapp, found.confidence, found.text) == (None, 0.0, "")
    assert [value for _, value in found.candidates] == [0.0] * 3


def test_empty_catalogue_names_none():
    found = meant("what time is it", commands={})
    assert (found.rapp, found.confidence, found.candidates) == (None, 0.0, ())
    assert found.text == "what time is it"


def test_rapp_without_sentences_is_last():
    found = meant("what time is it", commands={"mute": [], **COMMANDS})
    assert found.candidates[0][0] == "clock"
    assert found.candidates[-1] == ("mute", 0.0)


def test_chances_sum_to_one_and_keep_ratios():
    likelier, less = chances([-2.0, -2.0 - np.log(3)])
    assert likelier + less == pytest.approx(1)
    assert likelier / less == pytest.approx(3)
    assert chances([]) == []
