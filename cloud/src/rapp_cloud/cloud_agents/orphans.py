"""What an earlier platform left when it was killed: its agents' processes and folders. Blocking."""

import contextlib
import logging
import os
import shutil
import signal
from pathlib import Path

_log = logging.getLogger(__name__)
PID_FILE = "pid"


def note(folder: Path, pid: int) -> None:
    """Write down which process an agent's folder belongs to; undone with the folder."""
    (folder / PID_FILE).write_text(f"{pid} {_started(pid)}")


def clear(folder: Path) -> None:
    """Kill the sandboxes noted in the folders below, then remove those.

    A process is killed only when it started at the noted time, so that a reused process id is left alone (L12).
    """
    for place in folder.iterdir() if folder.is_dir() else ():
        with contextlib.suppress(OSError, ValueError):
            pid, started = (place / PID_FILE).read_text().split()
            if started == _started(int(pid)) != "":
                _log.warning("killing process %s, left by an earlier platform", pid)
                os.killpg(int(pid), signal.SIGKILL)  # bubblewrap, whose end the kernel makes its namespace's
        shutil.rmtree(place, ignore_errors=True)


def _started(pid: int) -> str:
    """When a process started, in clock ticks since boot; empty when there is none (proc(5), stat field 22)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    except (OSError, IndexError):
        return ""
