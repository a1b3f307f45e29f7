"""`catkin build` by itself, also with a foreign python3 first on PATH that has no catkin_pkg and no rospy."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from rapp_cli.paths import ROOT


@pytest.mark.timeout(300)
def test_the_workspace_builds_with_a_foreign_python3_first_on_path(tmp_path: Path) -> None:
    subprocess.run(["/usr/bin/python3", "-m", "venv", "--without-pip", tmp_path / "foreign"], check=True)
    workspace = tmp_path / "catkin_ws"
    for part in ("src", ".catkin_tools"):
        shutil.copytree(ROOT / "catkin_ws" / part, workspace / part, ignore=shutil.ignore_patterns("packages", "__pycache__"))
    env = {**os.environ, "PATH": f"{tmp_path / 'foreign' / 'bin'}:{os.environ['PATH']}"}
    assert shutil.which("python3", path=env["PATH"]) == str(tmp_path / "foreign" / "bin" / "python3")
    built = subprocess.run(
        ["catkin", "build", "--no-status"], cwd=workspace, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert built.returncode == 0, built.stdout
    assert (workspace / "devel" / "lib" / "python3" / "dist-packages" / "rapp_msgs" / "srv" / "_Say.py").is_file()
