"""Words, their pronunciation, their probability."""

import numpy
import pytest

from rapp_nao_sim.sound.synthesis import VoiceError, named, speak
from rapp_nao_sim.speech import pronunciation
from rapp_nao_sim.speech.pronunciation import pronounce, to_arpabet
from rapp_nao_sim.speech.recogniser import noise_floor, probability
from rapp_nao_sim.speech.text import REJECTED, match
from rapp_nao_sim.speech.words import spoken_words


@pytest.mark.parametrize(
    ("phrase", "words"),
    [
        ("E-Mail", ["e-mail"]),
        ("  what's  the time? ", ["what's", "the", "time"]),
        ("Łukasz, Zoë", ["łukasz", "zoë"]),
        ("rock'n'roll_2", ["rock'n'roll", "2"]),
        ("-- ' --", []),
        ("", []),
    ],
)
def test_a_phrase_is_split_into_words(phrase, words):
    assert spoken_words(phrase) == words


def test_text_is_matched_as_sound_would_be():
    vocabulary = ["e-mail", "What time", "Kowalska"]
    assert match("E-MAIL!", vocabulary) == [("e-mail", 1.0)]
    assert match("what time", vocabulary) == [("What time", 1.0)]
    assert match("what", vocabulary) == [("e-mail", REJECTED)]
    assert match("...", vocabulary) == []
    assert match("e-mail", []) == []


@pytest.mark.parametrize(
    ("ipa", "phones"),
    [
        ("kəvˈɑːlskə", "K AH V AA L S K AH"),
        ("tʃˈɜːtʃ", "CH ER CH"),
        ("bˈɜːɹd", "B ER D"),  # no R after ER
        ("nˈaʊ", "N AW"),
        ("əl\u0329 _ x", "AH L K"),
        ("☃", ""),
        ("", ""),
    ],
)
def test_ipa_becomes_arpabet(ipa, phones):
    assert to_arpabet(ipa) == phones


def test_a_word_is_pronounced_as_the_voice_says_it(monkeypatch):
    asked = []
    monkeypatch.setattr(pronunciation, "espeak", lambda *words: asked.append(words) or "ˈælɪs\n".encode())
    assert pronounce("--alice", "en-gb") == "AE L IH S"
    assert asked == [("-q", "--ipa", "-v", "en-gb", "--", "--alice")]


def test_without_espeak_the_error_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(VoiceError, match="install the Debian package espeak-ng"):
        pronounce("alice")
    with pytest.raises(VoiceError, match="install"):
        speak("hello", "en-us")


def test_an_error_of_espeak_does_not_repeat_what_was_to_be_said():
    with pytest.raises(VoiceError, match="xyzzy") as caught:
        speak("a secret", "xyzzy")
    assert "secret" not in str(caught.value)


def test_probabilities_are_some_and_grow_with_the_evidence():
    values = [probability(ratio, 60, 4) for ratio in (-3000.0, -200.0, -60.0, 0.0, 150.0, 3000.0)]
    assert values == sorted(values)
    assert all(0.0 <= value <= 1.0 for value in values)
    assert values[1] < 0.01
    assert values[4] > 0.9


def test_very_short_sounds_count_as_a_little_longer():
    assert probability(10.0, 0, 4) == probability(10.0, 8, 4)


def test_the_noise_floor_is_the_level_of_the_quietest_tenth():
    random = numpy.random.default_rng(1)
    sound = numpy.concatenate([random.normal(0, level, 3200) for level in (50, 2000, 2000, 2000)]).astype(numpy.int16)
    assert noise_floor(sound) == pytest.approx(50, rel=0.1)
    assert noise_floor(numpy.zeros(0, numpy.int16)) == 1.0


def test_a_language_without_its_region_has_one_voice():
    codes = named({"fr-be": "French (Belgium)", "fr-fr": "French (France)", "pl": "Polish", "es-419": "Spanish (Latin America)"})
    assert (codes["French"], codes["French (Belgium)"], codes["Polish"], codes["Spanish"]) == ("fr-fr", "fr-be", "pl", "es-419")
    assert named({"pt-br": "Portuguese (Brazil)", "pt": "Portuguese (Portugal)"})["Portuguese"] == "pt"
    assert named({"grc": "Greek (Ancient)", "el": "Greek"})["Greek"] == "el"
