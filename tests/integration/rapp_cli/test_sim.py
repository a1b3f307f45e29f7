"""`./rapp sim`: the simulator alone, and photographs of its room."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import pytest

GRACE = 4.0  # s, to end: twice of what it takes on a busy machine
QUIET = ("--microphone", "text", "--voice", "silent")


def rapp(*words: str, display: str = "") -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "rapp_cli", "sim", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, env={**os.environ, "DISPLAY": display}, check=False)


def test_it_serves_until_it_is_interrupted() -> None:
    command = [sys.executable, "-m", "rapp_cli", "sim", "--port", "0", *QUIET]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("READY ")
        assert json.loads(line[6:])["port"] not in (0, 9559)
        os.killpg(process.pid, signal.SIGINT)  # as the terminal does on Ctrl-C
        assert process.wait(GRACE) == 0


def test_the_room_is_photographed_as_told(tmp_path: Path) -> None:
    done = rapp("--shot", str(tmp_path / "room.png"), "--lamp", "0", "--door", "-0.3")
    assert (done.returncode, done.stdout) == (0, f"the room is photographed in {tmp_path / 'room.png'}\n"), done.stderr
    image = cv2.imread(str(tmp_path / "room.png"))
    assert image is not None
    assert image.std() > 10
    assert image.mean() < 100  # dark; with the lamp on it is about 160


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (
            ("--gui", "--port", "0", *QUIET),
            1,
            "cannot open a window: there is no screen here (DISPLAY is not set); use --shot FILE.png",
        ),
        (("--room", "nowhere.toml", "--port", "0", *QUIET), 1, "cannot read the room file nowhere.toml"),
        (("--shot", "room.png", "--port", "9"), 2, "cannot use --port with --shot"),
        (("--lamp", "0.5"), 2, "cannot use --lamp without --shot"),
    ],
)
def test_what_cannot_be_done_is_said(words: tuple[str, ...], status: int, said: str) -> None:
    done = rapp(*words)
    assert (done.returncode, done.stdout) == (status, "")
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_a_screen_that_does_not_answer_is_named() -> None:
    done = rapp("--gui", "--port", "0", *QUIET, display=":4444")
    assert (done.returncode, done.stdout) == (1, "")
    assert "cannot open a window on the screen :4444: it does not answer" in done.stderr
