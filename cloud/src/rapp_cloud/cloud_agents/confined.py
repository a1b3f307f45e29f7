"""The processes of one sandbox, from bubblewrap's own to the last grandchild: signalled, ended, reaped as one, in the loop."""

import asyncio
import contextlib
import os
import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path

from rapp_hop import strict_json
from rapp_hop.errors import Invalid, Refused

INFORMED = 5.0  # s for bubblewrap to tell the process it has started
KILLED = 2.0  # s for the kernel to end a process namespace
NEEDS = "it needs bubblewrap and unprivileged user namespaces, or root; see ARCHITECTURE.md, Confinement"


class Confined:
    """bubblewrap (our child) and the first process of its namespace, whose end is the end of all others in there."""

    def __init__(self, process: subprocess.Popen[bytes], first: int) -> None:
        self.first = first
        self._process = process
        self._first_handle = os.pidfd_open(first)
        self._there = {self._first_handle, os.pidfd_open(process.pid)}
        self._ended = asyncio.Event()
        for handle in self._there:
            asyncio.get_running_loop().add_reader(handle, self._gone, handle)

    @classmethod
    async def start(cls, words: Sequence[str], passed: Sequence[int], log: Path) -> "Confined":
        """Start the sandbox.

        To be awaited in the process's main thread: --die-with-parent means the thread that starts it.

        :param passed: descriptors it inherits
        :param log: takes what its processes print
        :raises Refused: there is no confinement here; the message has bubblewrap's own words
        """
        told, tell = os.pipe()
        try:
            with log.open("ab") as output:
                process = subprocess.Popen(
                    [words[0], "--info-fd", str(tell), *words[1:]],
                    stdin=subprocess.DEVNULL, stdout=output, stderr=output, pass_fds=(*passed, tell), start_new_session=True,
                    env={"PATH": os.environ.get("PATH", os.defpath)},
                )  # fmt: skip
        except OSError as error:
            os.close(told)
            raise Refused(f"cannot confine a cloud agent here: {words[0]}: {error.strerror}; {NEEDS}") from None
        finally:
            os.close(tell)
        started = None
        try:
            started = cls(process, await _first_process(told))
            return started
        except (Invalid, TimeoutError, OSError):
            said = log.read_text(errors="replace").strip().splitlines()[-1:] or ["it ended without a word"]
            raise Refused(f"cannot confine a cloud agent here: {said[0][:200]}; {NEEDS}") from None
        finally:
            if started is None:  # also when nobody waits for it any more
                _kill_unborn(process)

    @property
    def pid(self) -> int:
        """Process id of bubblewrap, also its group's."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the program inside runs."""
        return not self._ended.is_set()

    async def wait(self, seconds: float) -> bool:
        """Wait for the program inside to end; gives whether it has."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._ended.wait()
        return self._ended.is_set()

    async def end(self, patience: float) -> None:
        """SIGTERM to the processes inside, after `patience` s SIGKILL to all; returns when none is left."""
        if self.alive:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.first, signal.SIGTERM)
            await self.wait(patience)
        if self._first_handle in self._there:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._first_handle, signal.SIGKILL)
        if not await self.wait(KILLED):  # bubblewrap itself stands still
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            await self._ended.wait()

    def _gone(self, handle: int) -> None:
        """One of the two has ended; bubblewrap may be the first."""
        asyncio.get_running_loop().remove_reader(handle)
        os.close(handle)
        self._there.discard(handle)
        if not self._there:
            self._process.wait()
            self._ended.set()


def _kill_unborn(process: subprocess.Popen[bytes]) -> None:
    """Kill a bubblewrap that has not told its child yet, with that child: alone it would wait for its parent for ever."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


async def _first_process(told: int) -> int:
    """Process id that bubblewrap writes as JSON; closes the pipe."""
    reader = asyncio.StreamReader()
    pipe = os.fdopen(told, "rb", buffering=0)
    transport, _ = await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), pipe)
    try:
        async with asyncio.timeout(INFORMED):
            text = await reader.readuntil(b"}")
        found = strict_json.loads(text, limit=4096)
        if not isinstance(found, dict) or not isinstance(found.get("child-pid"), int):
            raise Invalid("cannot read what bubblewrap tells")
        return int(found["child-pid"])
    except (asyncio.IncompleteReadError, asyncio.LimitOverrunError):
        raise Invalid("bubblewrap told nothing") from None
    finally:
        transport.close()
