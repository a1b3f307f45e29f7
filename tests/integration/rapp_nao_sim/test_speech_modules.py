"""The modules that speak and recognise words, as a client written for a real NAO calls them."""

import numpy
import pytest


def test_saying_raises_its_events_in_order(texted, tts, events, wait_for):
    raised = events("ALTextToSpeech/CurrentSentence", "ALTextToSpeech/TextStarted", "ALTextToSpeech/TextDone")
    said = []
    link = texted.service("SimWorld").robotSaid.connect(said.append)
    assert tts.say("good morning") is None
    assert tts.say("dzień dobry", "Polish") is None
    wait_for(lambda: len(raised) == 8 and len(said) == 2)
    texted.service("SimWorld").robotSaid.disconnect(link)
    assert said == ["good morning", "dzień dobry"]
    assert {key.rpartition("/")[2] for key, _value in raised} == {"CurrentSentence", "TextStarted", "TextDone"}


def test_languages_by_their_english_names(tts, failing):
    assert {"English", "Polish", "French", "Portuguese", "Chinese"} <= set(tts.getAvailableLanguages())
    assert tts.getSupportedLanguages() == tts.getAvailableLanguages()
    tts.setLanguage("Polish")
    assert tts.getLanguage() == "Polish"
    with failing("ALTextToSpeech::setLanguage", "language Elvish is not installed"):
        tts.setLanguage("Elvish")
    assert tts.getLanguage() == "Polish"
    tts.setLanguage("English")
    with failing("ALTextToSpeech::say", "language Elvish is not installed"):
        tts.say("mellon", "Elvish")


def test_volume_and_speed_are_bounded(tts, failing):
    tts.setVolume(7.0)
    assert tts.getVolume() == 1.0
    tts.setParameter("speed", 80.0)
    tts.setParameter("pitchShift", 1.2)
    with failing("ALTextToSpeech::setVolume", "could not convert"):
        tts.setVolume("loud")


def test_the_speed_is_told_and_set_back(tts, failing):
    tts.setParameter("speed", 80.0)
    assert tts.getParameter("speed") == 80.0
    tts.resetSpeed()
    assert tts.getParameter("speed") == 100.0
    with failing("ALTextToSpeech::getParameter", "cannot find parameter 'pitchShift'"):
        tts.getParameter("pitchShift")


def test_a_voice_has_its_language(tts, failing):
    assert {"en-us", "pl", "fr-be"} <= set(tts.getAvailableVoices())
    tts.setVoice("fr-be")
    assert (tts.getVoice(), tts.getLanguage()) == ("fr-be", "French (Belgium)")
    tts.setLanguage("Polish")
    assert tts.getVoice() == "pl"
    with failing("ALTextToSpeech::setVoice", "voice xyzzy is not installed"):
        tts.setVoice("xyzzy")
    tts.setVoice("en-us")
    assert (tts.getVoice(), tts.getLanguage()) == ("en-us", "English")


def test_a_text_is_said_into_a_file(tts, failing, folder):
    def said(name):
        tts.sayToFile("good morning", str(folder / name))
        return numpy.fromfile(folder / name, "<i2").reshape(-1, 2)

    tts.setVolume(1.0)
    loud = said("loud.raw")
    assert 0.4 < len(loud) / 22050 < 2.0
    assert (loud[:, 0] == loud[:, 1]).all()
    assert loud.std() > 500
    tts.setVolume(0.25)
    tts.setParameter("speed", 50.0)
    slow = said("slow.raw")
    tts.setVolume(1.0)
    tts.resetSpeed()
    assert slow.std() < loud.std() / 2
    assert len(slow) > 1.3 * len(loud)
    with failing("ALTextToSpeech::sayToFile", "cannot write /none.raw"):
        tts.sayToFile("good morning", "/none.raw")


@pytest.mark.parametrize("arguments", [(), (5,), ("a", "English", "b")])
def test_saying_wrongly_is_an_error(tts, failing, arguments):
    with failing("ALTextToSpeech::say", ""):
        tts.say(*arguments)


@pytest.fixture
def recognition(texted):
    module = texted.service("ALSpeechRecognition")
    yield module
    module.unsubscribe("test")
    module.pause(False)


def test_words_are_recognised_in_the_order_rapp_used(texted, recognition, memory, events, wait_for):
    raised = events("WordRecognized")
    recognition.setLanguage("English")
    recognition.pause(True)
    recognition.setVocabulary(["E-mail", "clock"], False)
    recognition.pause(False)
    recognition.subscribe("test", 500, 0.0)
    assert memory.getData("WordRecognized") == ["", -3.0]
    texted.service("SimWorld").micText("e-mail")
    wait_for(lambda: bool(raised))
    assert raised == [("WordRecognized", ["E-mail", 1.0])]
    assert memory.getData("LastWordRecognized") == ["E-mail", 1.0]
    texted.service("SimWorld").micText("thunderstorm")
    wait_for(lambda: len(raised) == 2)
    assert raised[1][1][1] < 0.4


def test_a_vocabulary_needs_a_pause_and_words(recognition, failing):
    recognition.setVocabulary(["clock"], False)
    recognition.subscribe("test")
    with failing("ALSpeechRecognition::setVocabulary", "pause it first"):
        recognition.setVocabulary(["e-mail"], False)
    recognition.pause(True)
    for words in ([], ["clock", " "], "clock", [1], None):
        with failing("ALSpeechRecognition::setVocabulary", "cannot use this vocabulary"):
            recognition.setVocabulary(words, False)
    recognition.setWordListAsVocabulary(["e-mail"])


def test_only_english_is_heard(recognition, failing):
    assert recognition.getAvailableLanguages() == ["English"]
    assert recognition.getLanguage() == "English"
    with failing("ALSpeechRecognition::setLanguage", "language Polish is not installed"):
        recognition.setLanguage("Polish")


def test_what_has_nothing_to_set_is_accepted(texted, recognition):
    recognition.setParameter("Sensitivity", 0.5)
    recognition.setAudioExpression(False)
    recognition.setVisualExpression(False)
    texted.service("ALSoundDetection").setParameter("Sensitivity", 0.7)


@pytest.mark.parametrize(
    ("name", "events", "keys"),
    [
        ("ALSpeechRecognition", ["WordRecognized", "SpeechDetected"], ["LastWordRecognized"]),
        ("ALSoundDetection", ["SoundDetected"], []),
    ],
)
def test_what_hears_tells_its_subscribers_and_what_it_tells(texted, failing, name, events, keys):
    module = texted.service(name)
    assert (module.getEventList(), module.getMemoryKeyList()) == (events, keys)
    assert module.getOutputNames() == [*events, *keys]
    assert module.getCurrentPeriod() == 20
    module.subscribe("a", 500, 0.5)
    module.subscribe("b")
    assert module.getSubscribersInfo() == [["a", 500, 0.5], ["b", 20, 0.0]]
    module.updatePeriod("a", 100)
    module.updatePrecision("a", 1.0)
    assert (module.getMyPeriod("a"), module.getMyPrecision("a")) == (100, 1.0)
    module.unsubscribe("a")
    module.unsubscribe("b")
    assert module.getSubscribersInfo() == []
    for method, value in (("updatePeriod", [100]), ("updatePrecision", [1.0]), ("getMyPeriod", []), ("getMyPrecision", [])):
        with failing(f"{name}::{method}", "a is not subscribed"):
            getattr(module, method)("a", *value)


def test_a_pause_is_told(recognition):
    recognition.pause(True)
    assert recognition.isPaused() is True
    recognition.pause(False)
    assert recognition.isPaused() is False


def test_unsubscribing_what_never_subscribed_is_no_error(texted, recognition):
    recognition.unsubscribe("nobody")
    texted.service("ALSoundDetection").unsubscribe("nobody")
