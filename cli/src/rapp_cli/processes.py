"""Child processes of a command: started in order, watched, ended in reverse order.

Each child of ours prints one line `READY {json}` on stdout when it serves; everything it writes is kept in a log file.
"""

import asyncio
import contextlib
import json
import os
import signal
import sys
from collections.abc import Coroutine, Mapping, Sequence
from pathlib import Path
from typing import Any

from rapp_cli.errors import CommandError

READY_TIMEOUT = 40.0  # s, from start to the READY line
TERM_TIMEOUT = 12.0  # s, from SIGTERM to SIGKILL
LAST_WORDS = 2.0  # s for the rest of an ended process's output: whoever inherited it may hold it open
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


async def interruptible(work: Coroutine[Any, Any, int], name: str) -> int:
    """Do a command's work; Ctrl-C, SIGTERM and a closed terminal cancel it, so that every child is ended on the way out.

    Gives the exit status, 130 when it was interrupted. Signals that were ignored (nohup, a shell's background job) stay so.
    """
    task = asyncio.create_task(work)
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            asyncio.get_running_loop().add_signal_handler(number, task.cancel)
    try:
        return await task
    except asyncio.CancelledError:
        with contextlib.suppress(OSError):  # the terminal may be gone
            print(f"rapp {name}: interrupted; every process is ended", file=sys.stderr)
        return 130


class Child:
    """One process with its own process group and log file; it is told to end when this process dies."""

    def __init__(self, name: str, words: Sequence[str], env: Mapping[str, str], log: Path) -> None:
        self.name = name
        self.log = log
        self._words = list(words)
        self._env = dict(env)
        self._process: asyncio.subprocess.Process | None = None
        self._pump: asyncio.Task[None] | None = None
        self._ready: asyncio.Future[dict[str, Any]] | None = None

    async def start(self) -> dict[str, Any]:
        """Start the process and wait for its READY line; gives what that line says.

        Raises CommandError, with the end of the log, when the process ends or stays silent.
        """
        self.log.parent.mkdir(parents=True, exist_ok=True)
        self._ready = asyncio.get_running_loop().create_future()
        with self.log.open("ab") as log:
            self._process = await asyncio.create_subprocess_exec(
                *("setpriv", "--pdeathsig", "TERM", *self._words),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=log,
                env=self._env,
                start_new_session=True,
            )
        self._pump = asyncio.create_task(self._read_stdout())
        try:
            return await asyncio.wait_for(asyncio.shield(self._ready), READY_TIMEOUT)
        except TimeoutError:
            raise CommandError(f"cannot start {self.name}: not ready in {READY_TIMEOUT:.0f} s\n{self.tail()}") from None

    async def _read_stdout(self) -> None:
        assert self._process is not None
        assert self._process.stdout is not None
        assert self._ready is not None
        with self.log.open("ab", buffering=0) as log:
            async for line in self._process.stdout:
                log.write(line)
                if line.startswith(b"READY ") and not self._ready.done():
                    self._ready.set_result(json.loads(line[6:]))
        if not self._ready.done():
            status = await self._process.wait()
            self._ready.set_exception(CommandError(f"cannot start {self.name}: it ended with status {status}\n{self.tail()}"))

    def tail(self, lines: int = 15) -> str:
        """The end of the process's log, headed by the log's path."""
        text = self.log.read_text(errors="replace") if self.log.exists() else ""
        return "\n".join([f"--- {self.log}", *text.splitlines()[-lines:]])

    async def ended(self) -> int:
        """Wait until the process has ended by itself; gives its exit status."""
        assert self._process is not None
        return await self._process.wait()

    async def stop(self) -> None:
        """End the process: SIGTERM, then SIGKILL for its whole group; returns when it is reaped."""
        if self._process is None:
            return
        with contextlib.suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGTERM)
        try:
            await asyncio.wait_for(self._process.wait(), TERM_TIMEOUT)
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            await self._process.wait()
        if self._pump is not None:
            await asyncio.wait({self._pump}, timeout=LAST_WORDS)


class Children:
    """Several processes: `async with Children() as children`; all are ended, last started first, at the end."""

    def __init__(self) -> None:
        self._started: list[Child] = []

    async def __aenter__(self) -> "Children":
        return self

    async def __aexit__(self, *_exception: object) -> None:
        ending = asyncio.create_task(self._end())
        cancelled: asyncio.CancelledError | None = None
        while not ending.done():
            try:
                await asyncio.shield(ending)
            except asyncio.CancelledError as error:  # a further signal: told once all are ended
                cancelled = error
        if cancelled is not None:
            raise cancelled
        ending.result()

    async def _end(self) -> None:
        while self._started:
            await self._started.pop().stop()

    async def start(self, child: Child) -> dict[str, Any]:
        """Start one more; it is ended with the others even when it never becomes ready."""
        self._started.append(child)
        return await child.start()

    async def first_ended(self) -> Child:
        """Wait until any of them has ended by itself."""
        tasks = {asyncio.create_task(child.ended()): child for child in self._started}
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
        return tasks[done.pop()]
