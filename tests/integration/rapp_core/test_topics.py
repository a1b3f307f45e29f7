"""The topics of body and cameras from the real simulator, through the core agent's process, to a subscriber."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

LISTENER = str(Path(__file__).with_name("listen_to.py"))


@pytest.fixture(scope="module")
def told(start_for_module, ros_env, tmp_path_factory) -> dict[str, Any]:
    home = tmp_path_factory.mktemp("home")
    sim = start_for_module("rapp_nao_sim", "--microphone", "text", "--voice", "silent", "--port", "0", "--files", str(home))
    url = f"tcp://127.0.0.1:{sim.ready['port']}"
    start_for_module("rapp_core", "--robot", url, "--home", str(home))
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
