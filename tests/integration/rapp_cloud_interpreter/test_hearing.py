"""The interpreter with its real models and synthesised speech."""

import io
import pickle
import subprocess

import numpy as np
import pytest
import soundfile

from rapp_cloud.interpreter.errors import Invalid, Refused
from rapp_cloud.interpreter.hearing import interpret_recording, make_interpreter

COMMANDS = {
    "voice_mail": ["send an e-mail", "send a message to my daughter", "write a mail to a friend"],
    "clock": ["what time is it", "tell me the time"],
    "weather": ["what is the weather like today", "will it rain tomorrow"],
}


@pytest.fixture(scope="module")
def interpreter():
    return make_interpreter()


@pytest.fixture
def recording(tmp_path):
    """Makes a recording of a sentence at 20 dB as the robot would: ogg, with noise around it."""

    def record(text, voice="en-us+m3"):
        words = ["espeak-ng", "--stdout", "-v", voice, "-s", "150", "--", text]
        sound = subprocess.run(words, stdout=subprocess.PIPE, check=True, timeout=20).stdout
        speech, rate = soundfile.read(io.BytesIO(sound))
        samples = np.concatenate([np.zeros(rate // 2), 0.5 * speech, np.zeros(rate // 2)])
        level = 0.1 * np.sqrt(np.mean((0.5 * speech) ** 2))
        samples += level * np.random.default_rng(3).standard_normal(len(samples))
        file = tmp_path / "command.ogg"
        soundfile.write(file, np.clip(samples, -1, 1), rate, format="OGG", subtype="VORBIS")
        return file

    return record


@pytest.mark.parametrize("voice", ["en-us+m3", "en-us+f2"])
def test_paraphrase_names_its_rapp(interpreter, recording, voice):
    found = interpreter.interpret(recording("I would like to send a message to my son", voice), COMMANDS)
    assert found.rapp == "voice_mail"
    assert found.confidence > 0.75
    assert "message" in found.text


def test_quiet_before_the_sentence_does_no_harm(interpreter, recording):
    file = recording("I would like to send a message to my son")
    samples, rate = soundfile.read(file)
    quiet = 0.002 * np.random.default_rng(5).standard_normal(12 * rate)  # a whole listening round, and more than 384 frames
    soundfile.write(file, np.concatenate([quiet, samples]), rate, format="OGG", subtype="VORBIS")
    assert interpreter.interpret(file, COMMANDS).rapp == "voice_mail"


def test_foreign_sentence_names_none(interpreter, recording):
    found = interpreter.interpret(recording("the old castle stands on a hill above the town"), COMMANDS)
    assert found.rapp is None
    assert found.confidence < 0.5
    assert "castle" in found.text


def test_sentence_that_fits_two_is_asked_about(interpreter, recording):
    commands = {
        "voice_mail": ["send an e-mail", "I want to send a message to somebody", "I would like to dictate a letter"],
        "letter": ["write a letter to my family", "send a letter to somebody", "I would like to write a letter"],
        "clock": COMMANDS["clock"],
    }
    found = interpreter.interpret(recording("I would like to dictate a letter to my family"), commands)
    assert found.rapp is None
    assert sorted(found.choice) == ["letter", "voice_mail"]


def music(rate):
    """Three seconds of chords."""
    time = np.arange(3 * rate) / rate
    chords = [(262, 330, 392), (294, 349, 440), (247, 294, 392)]
    parts = np.array_split(time, len(chords))
    return np.concatenate([sum(0.1 * np.sin(2 * np.pi * f * t) for f in chord) for chord, t in zip(chords, parts, strict=True)])


NOT_SPEECH = {
    "silence": (np.zeros(48000), 16000),
    "noise": (0.05 * np.random.default_rng(2).standard_normal(48000), 16000),
    "clipped noise": (np.sign(np.random.default_rng(2).standard_normal(48000)), 16000),
    "music": (music(16000), 16000),
    "music in stereo at 48 kHz": (np.stack([music(48000)] * 2, axis=1), 48000),
}


@pytest.mark.parametrize("kind", NOT_SPEECH)
def test_v01_what_is_no_speech_names_none(interpreter, tmp_path, kind):
    file = tmp_path / "sound.wav"
    soundfile.write(file, *NOT_SPEECH[kind])
    assert interpreter.interpret(file, COMMANDS).rapp is None


def test_ten_minutes_are_refused_unread(interpreter, tmp_path):
    file = tmp_path / "sound.ogg"
    with soundfile.SoundFile(file, "w", 16000, 1, format="OGG", subtype="VORBIS") as sound:
        for _ in range(60):
            sound.write(np.zeros(160_000))
    with pytest.raises(Invalid, match=r"lasts 600 s"):
        interpreter.interpret(file, COMMANDS)


def test_very_short_sound_names_none(interpreter, tmp_path):
    file = tmp_path / "click.wav"
    soundfile.write(file, np.array([0.0, 0.5, -0.5]), 16000)
    assert interpreter.interpret(file, COMMANDS).rapp is None


def test_empty_catalogue_names_none(interpreter, recording):
    found = interpreter.interpret(recording("what time is it"), {})
    assert (found.rapp, found.candidates) == (None, ())


def test_v08_other_language_is_refused_by_name(interpreter, recording):
    with pytest.raises(Refused, match=r"^cannot interpret language 'pl': offered are en"):
        interpreter.interpret(recording("what time is it"), COMMANDS, "pl")


def test_set_up_and_function_travel_to_worker_processes():
    assert pickle.loads(pickle.dumps(make_interpreter)) is make_interpreter
    assert pickle.loads(pickle.dumps(interpret_recording)) is interpret_recording


def test_result_and_error_survive_pickling(interpreter, recording):
    found = interpreter.interpret(recording("what time is it"), COMMANDS)
    assert pickle.loads(pickle.dumps(found)) == found
    error = pickle.loads(pickle.dumps(Refused("cannot")))
    assert (error.kind, str(error)) == ("refused", "cannot")
