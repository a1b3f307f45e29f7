"""The robot's ears and voice by sound: words, foreign words, noise, two people at once, its own voice. Few: they take time."""

import os
import signal
import time

import numpy
import pytest
import soundfile

THRESHOLD = 0.4
VOCABULARY = ["e-mail", "clock", "Kowalska"]  # the last is in no dictionary


@pytest.fixture(scope="module")
def ears(sounding):
    """Subscribed to words and sounds; gives what was heard."""
    memory, recognition = sounding.service("ALMemory"), sounding.service("ALSpeechRecognition")
    heard = []
    words, sounds = memory.subscriber("WordRecognized"), memory.subscriber("SoundDetected")
    words.signal.connect(lambda value: heard.append((value[0], value[1])))
    sounds.signal.connect(lambda value: heard.append(("begin", "end")[1 - value[0][1]]))
    recognition.setVocabulary(VOCABULARY, False)
    recognition.subscribe("test", 500, 0.0)
    sounding.service("ALSoundDetection").subscribe("test")
    yield heard
    del words, sounds  # not before: a link ends with its subscriber


@pytest.fixture
def heard(ears, sounding):
    time.sleep(0.3)  # the floor settles
    ears.clear()
    return ears


@pytest.fixture
def world(sounding):
    return sounding.service("SimWorld")


def verdicts(heard):
    return [item for item in heard if isinstance(item, tuple)]


def accepted(heard):
    return [word for word, probability in verdicts(heard) if probability >= THRESHOLD]


@pytest.mark.parametrize(("said", "voice"), [("clock", "en-us+m3"), ("Kowalska", "en-us+f2")])
def test_a_word_is_heard_between_the_ends_of_its_sound(world, heard, wait_for, said, voice):
    world.personSay(said, voice)
    wait_for(lambda: verdicts(heard))
    assert heard[:2] == ["begin", "end"]
    assert accepted(heard) == [said]


def test_a_word_outside_of_the_vocabulary_is_improbable(world, heard, wait_for):
    world.personSay("thunderstorm", "en-us+m3")
    wait_for(lambda: verdicts(heard))
    assert accepted(heard) == []


def test_a_recording_of_a_person_is_heard(world, heard, folder, wait_for):
    random = numpy.random.default_rng(1)
    soundfile.write(folder / "hiss.wav", random.normal(0, 0.1, 22_050).astype(numpy.float32), 44_100)
    world.personPlay(str(folder / "hiss.wav"))
    wait_for(lambda: "end" in heard)
    assert heard[:2] == ["begin", "end"]
    assert accepted(heard) == []


def test_two_people_at_once_are_one_sound(world, sounding, heard, folder, wait_for):
    recorder = sounding.service("ALAudioRecorder")
    recorder.startMicrophonesRecording(str(folder / "two.wav"), "wav", 16000, [0, 0, 1, 0])
    both = [world.personSay(said, voice, _async=True) for said, voice in (("clock", "en-us+m3"), ("thunderstorm", "en-us+f2"))]
    wait_for(lambda: "begin" in heard)
    assert not any(future.isFinished() for future in both)  # they sound together
    for future in both:
        future.value(10_000)
    wait_for(lambda: "end" in heard)
    recorder.stopMicrophonesRecording()
    assert [item for item in heard if isinstance(item, str)] == ["begin", "end"]
    assert numpy.abs(soundfile.read(folder / "two.wav")[0]).max() > 0.2


def test_in_lasting_noise_the_robot_still_hears_who_is_louder(world, heard, wait_for):
    quiet = world.getNoise()
    try:
        world.setNoise(400.0)
        wait_for(lambda: verdicts(heard))  # on the noise, which is no word, and now known as noise
        assert accepted(heard) == []
        heard.clear()
        world.personSay("clock", "en-us+m3", {"level": 0.9})
        wait_for(lambda: verdicts(heard))
        assert "clock" in [word for word, _probability in verdicts(heard)]
    finally:
        world.setNoise(quiet)


def test_v02_the_robot_does_not_hear_itself(sounding, world, heard, wait_for):
    time.sleep(1.0)  # the floor falls after the noise
    heard.clear()
    sounding.service("ALTextToSpeech").say("clock")
    world.personSay("clock", "en-us+m3")
    wait_for(lambda: verdicts(heard))
    assert accepted(heard) == ["clock"]
    assert heard.count("begin") == 1


def test_a_text_is_stopped(sounding, wait_for):
    tts, memory = sounding.service("ALTextToSpeech"), sounding.service("ALMemory")
    said, interrupted = [], []
    world = sounding.service("SimWorld")
    link = world.robotSaid.connect(said.append)
    subscriber = memory.subscriber("ALTextToSpeech/TextInterrupted")
    subscriber.signal.connect(interrupted.append)
    spoken = [tts.say("a text that takes quite a while to say aloud, to its last word", _async=True) for _ in range(2)]
    wait_for(lambda: memory.getData("ALTextToSpeech/TextStarted") == 1)
    tts.stopAll()
    for future in spoken:
        future.value(3_000)
    wait_for(lambda: interrupted == [1])
    assert said == []
    tts.say("short")
    wait_for(lambda: said == ["short"])
    world.robotSaid.disconnect(link)


def test_ears_that_die_are_started_again(sounding, world, heard, children, gone, wait_for):
    [old] = children(sounding.process.pid)
    os.kill(old, signal.SIGKILL)
    wait_for(lambda: gone(old) and [pid for pid in children(sounding.process.pid) if pid != old and not gone(pid)])
    world.personSay("clock", "en-us+m3")
    wait_for(lambda: accepted(heard) == ["clock"])
