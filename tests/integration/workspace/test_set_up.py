"""The set-up of `./rapp` in a clone that is set up already but for who else is at it."""

import fcntl
import hashlib
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from rapp_cli.paths import ROOT

PYTHON = """#!/bin/sh
flock --nonblock "$CLONE" echo runs, and the folder is free
"""


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """Stamps say that all is there; its python says whether the folder is locked."""
    (tmp_path / "catkin_ws" / "src").mkdir(parents=True)
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    for name in ("rapp", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    python = tmp_path / ".venv" / "bin" / "python"
    python.write_text(PYTHON)
    python.chmod(0o755)
    seen = {
        "packages": f"{tmp_path}\n".encode() + (tmp_path / "rapp").read_bytes() + (tmp_path / "pyproject.toml").read_bytes(),
        "workspace": f"{tmp_path / 'catkin_ws' / 'src'}\n".encode(),
    }
    for name, content in seen.items():
        (tmp_path / ".venv" / f"{name}.sha256").write_text(f"{hashlib.sha256(content).hexdigest()}  -\n")
    return tmp_path


def test_two_runs_of_one_clone_set_it_up_one_after_the_other(clone: Path) -> None:
    other = os.open(clone, os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_EX)
    stamp = clone / ".venv" / "packages.sha256"
    done, once_more = stamp.read_text(), "of nothing yet"
    stamp.write_text(once_more)
    with subprocess.Popen([clone / "rapp"], stdout=-1, stderr=-1, text=True, env={**os.environ, "CLONE": str(clone)}) as run:
        assert run.stderr is not None
        assert run.stderr.readline() == "rapp: another ./rapp sets up this folder; waits for it ...\n"
        assert stamp.read_text() == once_more
        stamp.write_text(done)
        os.close(other)
        assert run.communicate(timeout=60) == ("runs, and the folder is free\n", "")


def test_what_a_step_of_the_set_up_starts_does_not_keep_the_folder_locked(clone: Path) -> None:
    script = (clone / "rapp").read_text()
    begin, end = script.index("once packages"), script.index("once workspace")
    (clone / "rapp").write_text(f"{script[:begin]}step daemon setsid --fork sleep 5\n{script[end:]}")
    run = subprocess.run([clone / "rapp"], capture_output=True, text=True, env={**os.environ, "CLONE": str(clone)}, timeout=60)
    assert run.stdout == "runs, and the folder is free\n"
