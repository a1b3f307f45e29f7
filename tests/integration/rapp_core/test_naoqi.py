"""The NAOqi adapters against a robot that is off, dies, comes back, hangs, or lacks a module."""

import signal

import pytest

from rapp_core.config import Config
from rapp_core.errors import Refused, Unreachable
from rapp_core.robot.naoqi import robot
from rapp_core.robot.naoqi.connection import Connection

SIM = ("rapp_nao_sim", "--microphone", "text", "--voice", "silent", "--no-world")


@pytest.fixture
def sim(start, tmp_path):
    def begin(port=0):
        return start(*SIM, "--files", str(tmp_path), "--port", str(port))

    return begin


@pytest.fixture
def connect():
    opened = []

    def to(started, timeout=5.0):
        connection = Connection(f"tcp://127.0.0.1:{started.ready['port']}", timeout)
        opened.append(connection)
        return connection, robot(connection, Config(name="test"))

    yield to
    for connection in opened:
        connection.close()


def test_a_robot_that_is_off_is_unreachable():
    nao = robot(Connection("tcp://127.0.0.1:1", 1.0), Config())
    with pytest.raises(Unreachable, match="is the robot on"):
        nao.voice.say("hello", "en")
    assert not nao.present()


@pytest.mark.parametrize("url", ["nonsense", "tcp://", "http://127.0.0.1:1"])
def test_an_address_that_is_none_is_unreachable(url):
    with pytest.raises(Unreachable):
        robot(Connection(url, 1.0), Config()).voice.hush()


def test_r08_a_lost_session_is_noticed_and_opened_anew(sim, connect, wait_for):
    started = sim()
    connection, nao = connect(started)
    nao.voice.say("hello", "en")
    assert started.stop(signal.SIGKILL) == -signal.SIGKILL
    wait_for(lambda: not nao.present())
    with pytest.raises(Unreachable):
        nao.voice.say("hello", "en")
    sim(started.ready["port"])
    nao.voice.say("hello again", "en")
    heard = []
    nao.ears.set_vocabulary(["clock"])
    nao.ears.subscribe(heard.append)
    connection.service("SimWorld").micText("clock")
    wait_for(lambda: [getattr(item, "text", "") for item in heard] == ["clock"])


def test_a_robot_that_hangs_does_not_hang_its_caller(sim, connect):
    started = sim()
    _connection, nao = connect(started, timeout=0.5)
    nao.recorder.stop()
    started.process.send_signal(signal.SIGSTOP)
    try:
        with pytest.raises(Unreachable, match="no answer"):
            nao.recorder.stop()
    finally:
        started.process.send_signal(signal.SIGCONT)
    nao.recorder.stop()


def test_a_module_that_is_missing_is_refused_by_name(sim, connect):
    _connection, nao = connect(sim())
    with pytest.raises(Refused, match="ALMotion"):
        nao.motion.stop()


def test_a_folder_where_the_robot_may_not_write_is_refused(sim, connect, tmp_path_factory):
    _connection, nao = connect(sim())
    nao.recorder.start(tmp_path_factory.mktemp("elsewhere") / "recording.ogg")
    with pytest.raises(Refused, match="cannot"):
        nao.recorder.stop()


@pytest.fixture
def received(monkeypatch):
    """What NAOqi is asked, in order: (module, method), the word `asynchronous` behind it where nobody waited at once."""
    asked = []
    start, result = Connection.start, Connection.result

    def started(connection, module, method, *args):
        asked.append((module, method, "asynchronous"))
        return start(connection, module, method, *args)

    def awaited(connection, future, module, method, timeout=None):
        if asked[-1] == (module, method, "asynchronous"):
            asked[-1] = (module, method)
        return result(connection, future, module, method, timeout)

    monkeypatch.setattr(Connection, "start", started)
    monkeypatch.setattr(Connection, "result", awaited)
    return asked


EARS, SOUNDS, RECORDER = "ALSpeechRecognition", "ALSoundDetection", "ALAudioRecorder"


def test_the_order_of_figure_6_reaches_naoqi(sim, connect, received, wait_for):
    connection, nao = connect(sim())
    heard = []
    nao.ears.set_vocabulary(["Elizabeth", "Margaret"])
    nao.ears.subscribe(heard.append)
    connection.service("SimWorld").micText("Margaret")
    wait_for(lambda: bool(heard))
    nao.ears.unsubscribe()
    assert heard[0].text == "Margaret"
    assert heard[0].probability > 0.4
    assert received == [
        (EARS, "pause"), (EARS, "setVocabulary"), (EARS, "pause"), ("ALMemory", "subscriber"), ("ALMemory", "subscriber"),
        (SOUNDS, "subscribe"), (EARS, "subscribe"), (EARS, "unsubscribe"), (SOUNDS, "unsubscribe"),
    ]  # fmt: skip
    assert connection.call("ALMemory", "getData", "LastWordRecognized")[0] == "Margaret"


def test_the_order_of_figure_7_reaches_naoqi(sim, connect, received, tmp_path):
    """Before it a recording that was left running is ended; nobody waits for the start, the end waits for both."""
    _connection, nao = connect(sim())
    nao.recorder.start(tmp_path / "recording.ogg")
    nao.recorder.energy()
    nao.recorder.stop()
    start, stop = "startMicrophonesRecording", "stopMicrophonesRecording"
    energy = ("ALAudioDevice", "getFrontMicEnergy")
    assert received == [(RECORDER, stop), (RECORDER, start, "asynchronous"), energy, (RECORDER, stop)]
    assert (tmp_path / "recording.ogg").exists()
