"""Each module's methods and errors, as a client written for a real NAO calls them."""

import threading
from itertools import pairwise

import numpy
import pytest
import qi
import soundfile


@pytest.fixture
def memory(texted):
    return texted.service("ALMemory")


@pytest.fixture
def tts(texted):
    return texted.service("ALTextToSpeech")


@pytest.fixture
def events(memory):
    """Collects what is raised for keys."""
    links = []

    def collect(*keys):
        raised = []
        for key in keys:
            subscriber = memory.subscriber(key)
            links.append((subscriber, subscriber.signal.connect(lambda value, key=key: raised.append((key, value)))))
        return raised

    yield collect
    for subscriber, link in links:
        subscriber.signal.disconnect(link)


@pytest.mark.parametrize(
    "name",
    [
        "ALMemory", "ALTextToSpeech", "ALSpeechRecognition", "ALSoundDetection", "ALAudioRecorder", "ALAudioDevice",
        "ALAudioPlayer", "SimWorld",
    ],
)  # fmt: skip
def test_every_module_answers(texted, name):
    module = texted.service(name)
    assert module.ping() is True
    assert module.version().startswith("2.1")
    assert module.getBrokerName() == "nao_sim"


def test_what_is_not_there_is_said(texted):
    with pytest.raises(RuntimeError, match="Cannot find service 'ALMotion'"):
        texted.service("ALMotion")
    with pytest.raises(AttributeError):
        _ = texted.service("ALMemory").noSuchMethod


# ALMemory


@pytest.mark.parametrize("value", [1, 0.5, True, "text", [1, ["two", 3.0]], {"a": [1]}])
def test_memory_keeps_values(memory, value):
    memory.insertData("kept", value)
    assert memory.getData("kept") == value
    assert "kept" in memory.getDataListName()
    memory.removeData("kept")
    assert "kept" not in memory.getDataListName()


def test_memory_does_not_invent_data(memory, failing):
    with failing("ALMemory::getData", "data not found: none"):
        memory.getData("none")
    with failing("ALMemory::getData", "missing 1 required"):
        memory.getData()


def test_events_reach_subscribers_in_order_and_insertions_do_not(memory, events, wait_for):
    raised = events("count")
    memory.insertData("count", -1)
    for number in range(50):
        memory.raiseEvent("count", number)
    wait_for(lambda: len(raised) == 50)
    assert [value for _key, value in raised] == list(range(50))
    assert memory.getData("count") == 49


def test_events_call_a_clients_module_as_naoqi_did(texted, memory, failing, wait_for):
    class Listener:
        def __init__(self):
            self.heard = []

        def onEvent(self, key, value, identifier):  # noqa: N802 - as clients spell it
            self.heard.append((key, value, identifier))

    listener = Listener()
    number = texted.session.registerService("Listener", listener)
    try:
        memory.subscribeToEvent("bell", "Listener", "onEvent")
        memory.raiseEvent("bell", "rings")
        wait_for(lambda: listener.heard == [("bell", "rings", "")])
        memory.unsubscribeToEvent("bell", "Listener")
        with failing("ALMemory::unsubscribeToEvent", "Listener is not subscribed to bell"):
            memory.unsubscribeToEvent("bell", "Listener")
    finally:
        texted.session.unregisterService(number)


# ALTextToSpeech


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


@pytest.mark.parametrize("arguments", [(), (5,), ("a", "English", "b")])
def test_saying_wrongly_is_an_error(tts, failing, arguments):
    with failing("ALTextToSpeech::say", ""):
        tts.say(*arguments)


# ALSpeechRecognition, ALSoundDetection


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


def test_unsubscribing_what_never_subscribed_is_no_error(texted, recognition):
    recognition.unsubscribe("nobody")
    texted.service("ALSoundDetection").unsubscribe("nobody")


# ALAudioRecorder


@pytest.fixture
def recorder(texted):
    module = texted.service("ALAudioRecorder")
    yield module
    module.stopMicrophonesRecording()


def record(recorder, path, kind, channels, wait_for):
    recorder.startMicrophonesRecording(str(path), kind, 16000, channels)
    wait_for(lambda: path.stat().st_size > 4000 if kind == "wav" else path.exists())
    recorder.stopMicrophonesRecording()
    return soundfile.info(path)


def test_recordings_are_complete_when_they_are_stopped(recorder, folder, wait_for):
    wav = record(recorder, folder / "four.wav", "wav", [1, 1, 1, 1], wait_for)
    assert (wav.channels, wav.samplerate, wav.subtype) == (4, 16000, "PCM_16")
    assert wav.frames > 0
    ogg = record(recorder, folder / "front.ogg", "ogg", (0, 0, 1, 0), wait_for)
    assert (ogg.channels, ogg.samplerate, ogg.subtype) == (1, 16000, "VORBIS")
    recorder.stopMicrophonesRecording()  # idle: no error


FRONT = [0, 0, 1, 0]


@pytest.mark.parametrize(
    ("name", "kind", "rate", "channels", "reason"),
    [
        ("/koukou", "ogg", 16000, FRONT, "cannot write /koukou"),
        ("nowhere/a.ogg", "ogg", 16000, FRONT, "cannot write nowhere/a.ogg"),
        ("{folder}/none/a.ogg", "ogg", 16000, FRONT, "its folder does not exist"),
        ("{folder}/a.mp3", "mp3", 16000, FRONT, "cannot record mp3"),
        ("{folder}/a.wav", "wav", 48000, FRONT, "cannot record at 48000 Hz"),
        ("{folder}/a.ogg", "ogg", 16000, [1, 0, 1, 0], "cannot record these channels"),
        ("{folder}/a.wav", "wav", 16000, [0, 0, 0, 0], "cannot record these channels"),
        ("{folder}/a.wav", "wav", 16000, [1], "cannot record these channels"),
        ("{folder}/a.wav", "wav", "much", FRONT, "invalid literal"),
    ],
)
def test_recording_what_cannot_be_is_an_error(recorder, failing, folder, name, kind, rate, channels, reason):
    with failing("ALAudioRecorder::startMicrophonesRecording", reason):
        recorder.startMicrophonesRecording(name.format(folder=folder), kind, rate, channels)


def test_one_recording_at_a_time(recorder, failing, folder):
    recorder.startMicrophonesRecording(str(folder / "one.wav"), "wav", 16000, FRONT)
    with failing("ALAudioRecorder::startMicrophonesRecording", "running already"):
        recorder.startMicrophonesRecording(str(folder / "two.wav"), "wav", 16000, FRONT)
    assert not (folder / "two.wav").exists()


# ALAudioDevice


@pytest.fixture
def device(texted):
    module = texted.service("ALAudioDevice")
    yield module
    module.unsubscribe("Samples")


def test_the_energy_of_a_quiet_room_is_below_the_usual_limit(device, wait_for):
    device.enableEnergyComputation()
    wait_for(lambda: 0.0 < device.getFrontMicEnergy() < 1700.0)
    device.disableEnergyComputation()


def test_the_output_volume_is_a_percentage(device, failing):
    device.setOutputVolume(130)
    assert device.getOutputVolume() == 100
    with failing("ALAudioDevice::setOutputVolume", "int()"):
        device.setOutputVolume(None)


def test_preferences_that_are_not_simulated_are_refused(device, failing):
    device.setClientPreferences("Samples", 16000, 3, 0)
    with failing("ALAudioDevice::setClientPreferences", "only single channels"):
        device.setClientPreferences("Samples", 48000, 0, 0)


class Samples:
    """A client's sound module; `raw` is declared as bytes, as a module must that wants them."""

    def __init__(self):
        self.lock = threading.Lock()
        self.got = []

    @qi.bind(qi.Void, (qi.Int32, qi.Int32, qi.Dynamic, qi.Buffer), "processRemote")
    def processRemote(self, channels, count, stamp, raw):  # noqa: N802
        with self.lock:
            self.got.append((channels, count, list(stamp), bytes(raw)))


@pytest.fixture
def samples(texted):
    samples = Samples()
    number = texted.session.registerService("Samples", samples)
    yield samples
    texted.session.unregisterService(number)


def test_a_clients_module_gets_raw_samples_until_it_unsubscribes(texted, device, samples, wait_for):
    device.subscribe("Samples")
    wait_for(lambda: len(samples.got) >= 2)
    device.unsubscribe("Samples")
    channels, count, stamp, raw = samples.got[0]
    assert (channels, count, len(raw)) == (1, 2730, 5460)
    assert stamp[0] > 1_600_000_000
    block = numpy.frombuffer(raw, "<i2")
    assert 20 < block.std() < 200  # the room's noise


def test_subscribing_twice_does_not_give_samples_twice(device, samples, wait_for):
    for _ in range(3):
        device.subscribe("Samples")
    wait_for(lambda: len(samples.got) >= 3)
    stamps = [stamp[0] + stamp[1] / 1e6 for _channels, _count, stamp, _raw in samples.got]
    assert min(later - earlier for earlier, later in pairwise(stamps)) > 0.05
    device.unsubscribe("Samples")
    number = len(samples.got)
    device.getFrontMicEnergy()
    wait_for(lambda: True)
    assert len(samples.got) <= number + 1


def test_a_module_that_is_not_there_is_an_error(device, failing):
    with failing("ALAudioDevice::subscribe", "cannot find module Nobody"):
        device.subscribe("Nobody")
    with failing("ALAudioDevice::subscribe", "no method processRemote"):
        device.subscribe("ALMemory")


# ALAudioPlayer


@pytest.fixture
def player(texted):
    module = texted.service("ALAudioPlayer")
    yield module
    module.stopAll()


@pytest.fixture(scope="module")
def tune(folder):
    soundfile.write(folder / "tune.ogg", numpy.zeros((8820, 2), numpy.float32), 44100, format="OGG", subtype="VORBIS")
    return str(folder / "tune.ogg")


def test_files_are_played_to_their_end(player, tune):
    assert player.getFileLengthFromPath(tune) == pytest.approx(0.2, abs=0.01)
    player.setMasterVolume(0.5)
    player.playFile(tune)
    player.playFile(tune, 0.5, -1.0)
    player.playFileFromPosition(tune, 0.1)


def test_a_loop_is_stopped_by_another_call(player, tune, wait_for):
    loop = player.playFileInLoop(tune, _async=True)
    once = player.playFile(tune)
    assert once is None
    assert not loop.isFinished()
    player.stopAll()
    loop.value(5000)


@pytest.mark.parametrize(
    ("method", "arguments", "reason"),
    [
        ("playFile", ("/none.wav",), "there is no such file"),
        ("playFile", (__file__,), "no sound file"),
        ("playFile", ("{tune}", 2.0, 0.0), "volume in 0..1"),
        ("playFileFromPosition", ("{tune}", 5.0), "position must lie in the file"),
        ("playFileInLoop", ("{tune}", 1.0, -3.0), "pan in -1..1"),
        ("getFileLengthFromPath", ("/",), "there is no such file"),
    ],
)
def test_playing_what_cannot_be_is_an_error(player, failing, tune, method, arguments, reason):
    arguments = [part.format(tune=tune) if isinstance(part, str) else part for part in arguments]
    with failing(f"ALAudioPlayer::{method}", reason):
        getattr(player, method)(*arguments)


# SimWorld


def test_a_world_that_is_not_there_is_said(texted, failing, folder):
    world = texted.service("SimWorld")
    with failing("SimWorld::getRobotPose", "--no-world"):
        world.getRobotPose()
    with failing("SimWorld::photograph", "--no-world"):
        world.photograph(str(folder / "room.png"))


@pytest.mark.parametrize(
    ("method", "arguments", "reason"),
    [
        ("personSay", ("hello", "nobody"), "nobody"),
        ("personSay", ("hello", "en-us", {"speed": "fast"}), "invalid literal"),
        ("personPlay", ("/none.wav",), "there is no such file"),
        ("setNoise", (-1.0,), "its level is from 0"),
        ("setNoise", ("loud",), "could not convert"),
    ],
)
def test_a_person_who_cannot_be_is_an_error(texted, failing, method, arguments, reason):
    with failing(f"SimWorld::{method}", reason):
        getattr(texted.service("SimWorld"), method)(*arguments)


def test_noise_is_set_and_measured(texted, device, wait_for):
    world = texted.service("SimWorld")
    quiet = world.getNoise()
    world.setNoise(1000.0)
    wait_for(lambda: device.getFrontMicEnergy() > 5000)
    world.setNoise(quiet)
    wait_for(lambda: device.getFrontMicEnergy() < 1700)
