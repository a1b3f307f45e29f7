"""The topics of body and cameras from the real simulator, through the core agent's process, to a subscriber."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rapp_core.robot.naoqi.connection import Connection

LISTENER = str(Path(__file__).with_name("listen_to.py"))


PATIENCE = 30.0  # s


@pytest.fixture(scope="module")
def robot(start_for_module, tmp_path_factory) -> Iterator[Connection]:
    home = tmp_path_factory.mktemp("home")
    sim = start_for_module("rapp_nao_sim", "--microphone", "text", "--voice", "silent", "--port", "0", "--files", str(home))
    url = f"tcp://127.0.0.1:{sim.ready['port']}"
    start_for_module("rapp_core", "--robot", url, "--home", str(home))
    connection = Connection(url, 5.0)
    yield connection
    connection.close()


@pytest.fixture(scope="module")
def told(robot, ros_env) -> dict[str, Any]:
    words = [sys.executable, LISTENER]
    done = subprocess.run(words, env=ros_env, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(line) for line in done.stdout.splitlines())


def test_the_joints_are_those_of_a_nao(told):
    assert {"HeadYaw", "HeadPitch", "LShoulderPitch", "RHand"} <= set(told["joint_states"])


def test_odometry_and_transforms_form_the_tree_of_rep_105(told):
    assert told["odom"][:2] == ["odom", "base_link"]
    tree = {child: parent for parent, child in told["/tf"]}
    assert (tree["base_link"], tree["odom"]) == ("odom", "map")
    for frame in ("torso", "camera_top_optical_frame", "camera_bottom_optical_frame"):
        assert tree[frame] == "base_link"


def test_sonars_and_bumpers_speak(told):
    assert [told[f"sonar/{side}"][0] for side in ("left", "right")] == ["sonar_left", "sonar_right"]
    assert all(told[f"sonar/{side}"][1] > 0.1 for side in ("left", "right"))
    assert told["bumper/left"] is False


def test_both_cameras_see_something(told):
    for camera in ("top", "bottom"):
        width, height, encoding, size, content = told[f"camera/{camera}/image_raw"]
        assert (width, height, encoding, size) == (320, 240, "bgr8", 320 * 240 * 3)
        assert content > 0
    assert told["camera/top/image_raw/compressed"][1] == "ffd8"
    assert 260 < told["camera/top/camera_info"][2] < 290  # pixels of focal length at QVGA and 61 degrees


def test_diagnostics_tell_that_all_is_well_but_the_link(told):
    levels = {name: level for name, (level, _message) in told["/diagnostics"].items()}
    assert levels == {"rapp: core agent": 0, "rapp: robot": 0, "rapp: link": 1}


def test_what_nobody_listens_to_any_more_is_not_measured_any_more(robot, told):
    assert told
    deadline = time.monotonic() + PATIENCE
    while robot.call("ALSonar", "getSubscribersInfo") or robot.call("ALVideoDevice", "getSubscribers"):
        assert time.monotonic() < deadline, "sonars or cameras stay on"
        time.sleep(0.1)
