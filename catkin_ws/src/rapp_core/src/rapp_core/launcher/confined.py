"""The processes of one sandbox, from bubblewrap's own to the last grandchild: signalled, ended, reaped as one."""

import contextlib
import ctypes
import json
import os
import select
import signal
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

from rapp_core.errors import Bug

INFORMED = 3.0  # s for bubblewrap to tell the process it has started
KILLED = 2.0  # s for the kernel to end a process namespace
NOTICED = 0.5  # s for bubblewrap to notice that and to end
_PR_SET_CHILD_SUBREAPER = 36  # prctl(2)


def adopt_orphans() -> None:
    """Become the parent of what bubblewrap leaves when it ends first, so that it can be reaped; holds for this process."""
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


class Confined:
    """bubblewrap (our child) and the first process of its namespace, whose end is the end of all others in there."""

    def __init__(self, words: list[str], passed: Sequence[int], log: int, account: int | None = None) -> None:
        """Start the sandbox with some descriptors passed in. Raises Bug.

        `account`: user id that root gives the sandbox's user namespace beside its own; others have just their own there.
        Call it from a thread that lives as long as this process: --die-with-parent means the starting thread.
        """
        told, tell = os.pipe()
        held, hold = os.pipe()  # bubblewrap waits at it for the ids that only we may give
        waits = [] if account is None else ["--userns-block-fd", str(held)]
        try:
            self._process = subprocess.Popen(
                [words[0], "--info-fd", str(tell), *waits, *words[1:]],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                pass_fds=(*passed, tell, held),
                start_new_session=True,
                env={"PATH": os.environ.get("PATH", os.defpath)},
            )
        except OSError as error:
            for each in (told, hold):
                os.close(each)
            raise Bug(f"cannot start the sandbox: {error}; install the Debian package bubblewrap") from error
        finally:
            for each in (tell, held):
                os.close(each)
        self.first = _first_process(told)
        if account is not None and self.first is not None:
            _give(self.first, account)
        os.close(hold)
        self._handle: int | None = None
        with contextlib.suppress(OSError):  # it may have ended already
            if self.first is not None:
                self._handle = os.pidfd_open(self.first)

    @property
    def pid(self) -> int:
        """Process id of bubblewrap, also its group's."""
        return self._process.pid

    @property
    def status(self) -> int | None:
        """Exit status of the program inside, or minus the signal that ended bubblewrap; None while it runs."""
        return self._process.poll()

    @property
    def alive(self) -> bool:
        """Whether the program inside runs."""
        return self._process.poll() is None

    def wait(self, seconds: float) -> bool:
        """Wait for the program inside to end; gives whether it has."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)
        return not self.alive

    def end(self, patience: float) -> None:
        """SIGTERM to the processes inside, after `patience` s SIGKILL to all; returns when none is left."""
        if self.alive and self.first is not None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.first, signal.SIGTERM)
            self.wait(patience)
        self._kill()
        self._process.wait()

    def _kill(self) -> None:
        handle, self._handle = self._handle, None
        if handle is not None:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(handle, signal.SIGKILL)
            select.select([handle], [], [], KILLED)
            os.close(handle)
        if not self.wait(NOTICED):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
        if self.first is not None:
            with contextlib.suppress(ChildProcessError):  # bubblewrap has reaped it itself
                os.waitpid(self.first, os.WNOHANG)


def _give(pid: int, account: int) -> None:
    """Let a new user namespace have root's id and the account's (user_namespaces(7)).

    A process that has ended meanwhile is seen to have ended by whoever waits for it.
    """
    with contextlib.suppress(OSError):
        for kind in ("uid", "gid"):
            Path(f"/proc/{pid}/{kind}_map").write_text(f"0 0 1\n{account} {account} 1\n")


def _first_process(told: int) -> int | None:
    """Process id that bubblewrap writes as JSON; None when it ended without."""
    text, deadline = b"", time.monotonic() + INFORMED
    try:
        while select.select([told], [], [], max(0.0, deadline - time.monotonic()))[0]:
            piece = os.read(told, 4096)
            text += piece
            if not piece or b"}" in text:
                break
    finally:
        os.close(told)
    with contextlib.suppress(ValueError, KeyError, TypeError):
        return int(json.loads(text)["child-pid"])
    return None
