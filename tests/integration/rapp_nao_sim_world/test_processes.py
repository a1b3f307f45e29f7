"""The world's processes: started, noticed when they die, never left behind."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import cv2
import pytest

from fakes.processes import children, ended
from rapp_nao_sim.world.errors import Invalid, Unreachable
from rapp_nao_sim.world.process import WorldClient, WorldConfig

PATIENCE = 20.0  # s
SMALL = WorldConfig(width=320, height=240)  # pictures


def test_close_leaves_no_process(tmp_path: Path) -> None:
    before = children(os.getpid())
    world = WorldClient(SMALL)
    world.start()
    world.photograph(tmp_path / "room.png")
    started = set(children(os.getpid())) - set(before)
    assert len(started) == 2
    world.close()
    assert all(ended(pid) for pid in started)
    assert not world.alive()
    with pytest.raises(Unreachable, match="not running"):
        world.robot_pose()
    world.close()


def test_a_dead_process_is_noticed_by_who_waits_and_by_who_asks() -> None:
    errors: list[Exception] = []

    def wait() -> None:
        try:
            world.set_posture("Sit", 0.05)
        except Unreachable as error:
            errors.append(error)

    with WorldClient() as world:
        waiting = threading.Thread(target=wait)
        waiting.start()
        deadline = time.monotonic() + PATIENCE
        while not world.is_moving():
            assert time.monotonic() < deadline
        assert world.pid is not None
        os.kill(world.pid, signal.SIGKILL)
        waiting.join(PATIENCE)
        assert len(errors) == 1
        with pytest.raises(Unreachable):
            world.robot_pose()
        assert not world.alive()


def test_a_hung_process_is_ended_all_the_same() -> None:
    world = WorldClient()
    world.start()
    pid = world.pid
    assert pid is not None
    os.kill(pid, signal.SIGSTOP)
    world.close()
    assert ended(pid)


def test_a_dead_renderer_is_started_anew(tmp_path: Path) -> None:
    with WorldClient(SMALL) as world:
        world.photograph(tmp_path / "1.png")
        renderer = next(pid for pid in children(os.getpid()) if "renderer" in Path(f"/proc/{pid}/cmdline").read_text())
        os.kill(renderer, signal.SIGKILL)
        deadline = time.monotonic() + PATIENCE
        while not ended(renderer):
            assert time.monotonic() < deadline
        world.photograph(tmp_path / "2.png")
        assert (tmp_path / "2.png").stat().st_size > 10_000


def test_no_process_outlives_its_parent() -> None:
    program = (
        "from rapp_nao_sim.world.process import WorldClient\n"
        "world = WorldClient(); world.start(); print(world.pid, flush=True); input()"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        assert not ended(pid)
        parent.kill()
    deadline = time.monotonic() + PATIENCE
    while not ended(pid):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_a_wrong_room_file_ends_the_start_with_its_reason(tmp_path: Path) -> None:
    before = children(os.getpid())
    file = tmp_path / "room.toml"
    file.write_text("[floor]\nsize = [1.0]\n")
    with pytest.raises(Invalid, match="'size' of"):
        WorldClient(WorldConfig(room=file)).start()
    with pytest.raises(Invalid, match="Handstand"):
        WorldClient(WorldConfig(posture="Handstand")).start()
    assert children(os.getpid()) == before


def test_the_command_writes_a_picture_and_says_nothing_else_than_where(tmp_path: Path) -> None:
    words = [
        sys.executable,
        "-m",
        "rapp_nao_sim.world",
        "--shot",
        str(tmp_path / "room.png"),
        "--posture",
        "Sit",
        "--lamp",
        "1",
    ]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (0, f"the room is photographed in {tmp_path / 'room.png'}\n")
    image = cv2.imread(str(tmp_path / "room.png"))
    assert image is not None and image.shape == (720, 960, 3)
    text, _, _ = cv2.QRCodeDetector().detectAndDecode(image[200:360, 640:780])  # hung unmirrored, and sharp enough to be read
    assert text == '{"name": "door"}'
    words[-1] = "7"
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert "cannot set the lamp" in done.stderr
