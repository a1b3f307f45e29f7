"""What a platform leaves when it is killed: its agents' processes and folders, cleared by its keeper, or by the next platform.

The kernel ends a sandbox with the platform (--die-with-parent), but not one that bubblewrap is just about to make: that process
waits for ever. So beside a platform that runs agents there is a process that waits for its end, `python -m
rapp_cloud.cloud_agents.orphans FOLDER NAME`, and then clears what is left of its agents. Blocking.
"""

import contextlib
import logging
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

RUNS = "runs"  # of the folder of all cloud agents
AGAIN, TIMES = 0.5, 4  # s between looks, and looks: a process may be about to start another one

_log = logging.getLogger(__name__)


class Keeper:
    """The process; it clears at the end of this one, however that comes, and at `close`."""

    def __init__(self, folder: Path, name: str) -> None:
        """Start it; agents' folders, in `runs` of the folder, begin with `name`."""
        words = [sys.executable, "-m", "rapp_cloud.cloud_agents.orphans", str(folder), name]
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True)

    def close(self) -> None:
        """End it; returns when nothing is left."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def clear(runs: Path, name: str = "") -> bool:
    """Kill the sandboxes of the agents whose folders begin with `name`, remove the folders; gives whether there was any.

    A sandbox is known by its agent's folder among bubblewrap's words: such a folder has a random name, and no process id, which
    may be another's by now, is needed (L12).
    """
    folders = [path for path in runs.iterdir() if path.name.startswith(name)] if runs.is_dir() else []
    found = _sandboxes([f"{folder}/" for folder in folders]) if folders else []
    for pid in found:
        _log.warning("killing process %s, left by a platform", pid)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(pid, signal.SIGKILL)
    for folder in folders:
        shutil.rmtree(folder, ignore_errors=True)
    return bool(folders)


def _sandboxes(places: list[str]) -> list[int]:
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            program, *words = path.read_bytes().decode(errors="replace").split("\0")
            if program.endswith("bwrap") and any(word.startswith(place) for place in places for word in words):
                found.append(int(path.parent.name))
    return found


def main() -> None:
    """Wait for the end of the platform, which holds the other end of our standard input; clear."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # the platform's end is ours
    logging.basicConfig(stream=sys.stderr, format="%(asctime)s %(name)s %(levelname)s %(message)s")
    runs, name = Path(sys.argv[1]) / RUNS, sys.argv[2]
    sys.stdin.buffer.read()
    for _ in range(TIMES):
        if not clear(runs, name):
            break
        time.sleep(AGAIN)


if __name__ == "__main__":
    main()
