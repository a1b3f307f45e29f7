"""The simulator's processes: they end together, and every failure is one line that says what to do."""

import os
import signal
import subprocess
import sys

import pytest
import qi

QUICK = ("--microphone", "text", "--voice", "silent")
GRACE = 4  # s, to end: twice of what it takes on a busy machine


def run(*words):
    return subprocess.run([sys.executable, "-m", "rapp_nao_sim", *words], capture_output=True, text=True, timeout=30)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_ends_in_the_midst_of_everything_without_a_child(simulate, tmp_path, number, children, gone, wait_for):
    sim = simulate()
    calls = [
        sim.service("ALTextToSpeech").say("a text that takes quite a while to say aloud, to its last word", _async=True),
        sim.service("ALMotion").angleInterpolation("HeadYaw", 1.0, 20.0, True, _async=True),
        sim.service("SimWorld").personSay("somebody speaks meanwhile, and does not stop", "en-us+f3", _async=True),
        sim.service("SimWorld").photograph(str(tmp_path / "room.png"), _async=True),
    ]
    sim.service("ALAudioRecorder").startMicrophonesRecording(str(tmp_path / "a.ogg"), "ogg", 16000, [0, 0, 1, 0])
    wait_for(lambda: len(children(sim.process.pid)) == 3)
    started = children(sim.process.pid)  # body, ears, and what draws the picture
    assert not any(call.isFinished() for call in calls)
    sim.process.send_signal(number)
    assert sim.process.wait(GRACE) == 0
    assert all(gone(pid) for pid in started)


def test_a_killed_simulator_leaves_no_child(simulate, gone, wait_for):
    sim = simulate()
    sim.process.kill()
    sim.process.wait()
    wait_for(lambda: all(gone(pid) for pid in sim.children))


def test_a_busy_port_is_one_clear_line(simulate):
    port = simulate(*QUICK, "--no-world").port
    done = run("--port", str(port))
    assert (done.returncode, done.stdout) == (1, "")
    [line] = done.stderr.splitlines()
    assert line.endswith(
        f"cannot listen on 127.0.0.1:{port}: another program listens there; end it, or choose another --port (0: any free one)"
    )


def test_an_address_that_is_not_ours_is_one_clear_line():
    done = run(*QUICK, "--no-world", "--address", "192.0.2.1", "--port", "0")
    assert (done.returncode, done.stdout) == (1, "")
    [line] = done.stderr.splitlines()
    assert "cannot listen on 192.0.2.1:0: " in line


def test_without_a_body_it_ends_and_says_why(simulate, failing):
    sim = simulate(*QUICK)
    moving = sim.service("ALMotion").angleInterpolation("HeadYaw", 1.0, 20.0, True, _async=True)
    assert len(sim.service("SimWorld").getRobotPose()) == 3
    [body] = sim.children
    os.kill(body, signal.SIGKILL)
    with failing("ALMotion::angleInterpolation", "start the simulator again"):
        moving.value(5_000)
    assert sim.process.wait(10) == 1
    assert "cannot go on: the process of the robot's body has died; start nao_sim again" in sim.log.read_text()
    assert "Traceback" not in sim.log.read_text()


def test_a_client_that_leaves_does_not_disturb_the_others(simulate, wait_for):
    sim = simulate(*QUICK, "--no-world")
    leaver = qi.Session()
    leaver.connect(f"tcp://127.0.0.1:{sim.port}")
    heard = []
    memory = leaver.service("ALMemory")
    subscriber = memory.subscriber("WordRecognized")
    subscriber.signal.connect(heard.append)
    recognition = sim.service("ALSpeechRecognition")
    recognition.setVocabulary(["clock"], False)
    recognition.subscribe("stayer")
    leaver.close()
    sim.service("SimWorld").micText("clock")
    wait_for(lambda: sim.service("ALMemory").getData("WordRecognized") == ["clock", 1.0])
    assert heard == []
