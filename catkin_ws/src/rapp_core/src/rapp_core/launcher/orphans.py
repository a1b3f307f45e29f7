"""What an earlier core agent left when it was killed: its runs' processes and folders."""

import contextlib
import logging
import os
import shutil
import signal
from pathlib import Path

_log = logging.getLogger(__name__)
PID_FILE = "pid"


def note(folder: Path, pid: int) -> None:
    """Write down which process a run's folder belongs to; undone with the folder."""
    (folder / PID_FILE).write_text(f"{pid} {_started(pid)}")


def clear(runs: Path) -> None:
    """Kill the process groups noted in the folders of `runs`, then remove the folders.

    A process is killed only when it started at the noted time, so that a reused process id is left alone.
    """
    for folder in runs.iterdir() if runs.is_dir() else ():
        with contextlib.suppress(OSError, ValueError):
            pid, started = (folder / PID_FILE).read_text().split()
            if started == _started(int(pid)) != "":
                _log.warning("killing process %s, left by an earlier core agent", pid)
                os.killpg(int(pid), signal.SIGKILL)
        for sandbox in _about_to_start(folder):
            with contextlib.suppress(ProcessLookupError):
                os.kill(sandbox, signal.SIGKILL)
        shutil.rmtree(folder, ignore_errors=True)


def _about_to_start(folder: Path) -> list[int]:
    """Process ids of bubblewraps whose words name the folder: one whose parent died in its first moments waits for ever."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            program, *words = path.read_bytes().decode(errors="replace").split("\0")
            if program.endswith("bwrap") and any(word.startswith(f"{folder}/") for word in words):
                found.append(int(path.parent.name))
    return found


def _started(pid: int) -> str:
    """When a process started, in clock ticks since boot; empty when there is none (proc(5), stat field 22)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    except (OSError, IndexError):
        return ""
