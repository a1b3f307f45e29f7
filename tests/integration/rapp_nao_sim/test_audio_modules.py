"""The modules that record, hear and play, as a client written for a real NAO calls them."""

import threading
from itertools import pairwise

import numpy
import pytest
import qi
import soundfile


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


def test_the_energy_of_a_quiet_room_is_below_the_usual_limit(device, wait_for):
    device.enableEnergyComputation()
    wait_for(lambda: 0.0 < device.getFrontMicEnergy() < 1700.0)
    device.disableEnergyComputation()


def test_the_output_volume_is_a_percentage(device, failing):
    device.setOutputVolume(130)
    assert device.getOutputVolume() == 100
    with failing("ALAudioDevice::setOutputVolume", "int()"):
        device.setOutputVolume(None)


MICROPHONES = ("Front", "Left", "Right", "Rear")


def test_closed_microphones_hear_nothing(device, wait_for):
    energies = [getattr(device, f"get{name}MicEnergy") for name in MICROPHONES]
    wait_for(lambda: min(energy() for energy in energies) > 0.0)
    device.closeAudioInputs()
    try:
        assert [energy() for energy in energies] == [0.0] * 4
    finally:
        device.openAudioInputs()
    wait_for(lambda: min(energy() for energy in energies) > 0.0)


def test_a_muted_loudspeaker_is_silent_and_a_quiet_one_quieter(device, player, loud, wait_for):
    device.setOutputVolume(100)
    player.setMasterVolume(1.0)
    playing = player.playFileInLoop(loud, _async=True)
    wait_for(lambda: device.getFrontMicEnergy() > 3000)
    device.muteAudioOut(True)
    assert device.isAudioOutMuted() is True
    wait_for(lambda: device.getFrontMicEnergy() < 1700)
    device.muteAudioOut(False)
    wait_for(lambda: device.getFrontMicEnergy() > 3000)
    device.setOutputVolume(1)
    wait_for(lambda: device.getFrontMicEnergy() < 1700)
    device.setOutputVolume(100)
    player.stopAll()
    playing.value(5000)


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


@pytest.fixture
def player(texted):
    module = texted.service("ALAudioPlayer")
    yield module
    module.stopAll()


@pytest.fixture(scope="module")
def tune(folder):
    soundfile.write(folder / "tune.ogg", numpy.zeros((8820, 2), numpy.float32), 44100, format="OGG", subtype="VORBIS")
    return str(folder / "tune.ogg")


@pytest.fixture(scope="module")
def loud(folder):
    path = folder / "loud.wav"
    soundfile.write(path, numpy.sin(numpy.arange(32000) * 0.1), 16000)
    return str(path)


def test_a_loaded_file_is_played_paused_and_played_on(player, device, loud, failing, wait_for):
    number = player.loadFile(loud)
    assert player.getFileLength(number) == 2.0
    assert player.getCurrentPosition(number) == 0.0
    player.pause(number)  # it does not play: no effect
    playing = player.play(number, _async=True)
    wait_for(lambda: player.getCurrentPosition(number) > 0.1)
    player.pause(number)
    at = player.getCurrentPosition(number)
    wait_for(lambda: 0.0 < device.getFrontMicEnergy() < 1700)  # time has passed in the room
    assert player.getCurrentPosition(number) == pytest.approx(at, abs=0.021)
    assert not playing.isFinished()
    assert player.play(number) is None
    playing.value(5000)
    assert player.getCurrentPosition(number) == 0.0
    again = player.play(number, 0.5, 0.0, _async=True)
    wait_for(lambda: player.getCurrentPosition(number) > 0.0)
    player.unloadFile(number)
    again.value(5000)
    for method in ("play", "pause", "getFileLength", "getCurrentPosition", "unloadFile"):
        with failing(f"ALAudioPlayer::{method}", f"cannot find file {number}"):
            getattr(player, method)(number)


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
        ("loadFile", ("/none.wav",), "there is no such file"),
    ],
)
def test_playing_what_cannot_be_is_an_error(player, failing, tune, method, arguments, reason):
    arguments = [part.format(tune=tune) if isinstance(part, str) else part for part in arguments]
    with failing(f"ALAudioPlayer::{method}", reason):
        getattr(player, method)(*arguments)
