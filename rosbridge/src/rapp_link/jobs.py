"""Jobs: what the core agent has asked for and not yet got (DESIGN section 3.2). No I/O but the events it is given to tell."""

import asyncio
import json
import logging
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Protocol

from rapp_hop.errors import HopError
from rapp_link.errors import LinkError

_log = logging.getLogger(__name__)
Progress = Callable[[str, float], None]
Command = Callable[[Mapping[str, Any], Progress], Awaitable[Any]]


class Events(Protocol):
    """Where progress and ends are told."""

    def progress(self, job: str, phase: str, fraction: float) -> None: ...  # noqa: D102
    def done(self, job: str, result: str) -> None: ...  # noqa: D102
    def failed(self, job: str, kind: str, message: str) -> None: ...  # noqa: D102


class Jobs:
    """Open jobs, each a task with a deadline; every job accepted ends with just one event."""

    def __init__(self, commands: Mapping[str, Command], events: Events, most: int) -> None:
        self._commands = commands
        self._events = events
        self._most = most
        self._open: dict[str, asyncio.Task[None]] = {}

    def accept(self, command: str, job: str, arguments: str, timeout: float) -> str:
        """Start a job; gives "" when it was accepted, else why not. Runs in the event loop."""
        if job in self._open or not job:
            return f"cannot start job {job!r}: its id is empty or in use"
        if len(self._open) >= self._most:
            return f"cannot start another job: {self._most} are open already; try again later"
        try:
            values = json.loads(arguments)
        except ValueError as error:
            return f"cannot read the arguments: {error}"
        if not isinstance(values, dict):
            return "cannot read the arguments: they are no JSON object"
        task = asyncio.create_task(self._run(command, job, values, timeout if timeout > 0 else None))
        self._open[job] = task
        task.add_done_callback(lambda _task: self._open.pop(job, None))
        return ""

    def cancel(self, job: str) -> None:
        """End a job; nothing is told of it any more."""
        task = self._open.get(job)
        if task is not None:
            task.cancel()

    def cancel_all(self) -> None:
        """End all jobs."""
        for task in list(self._open.values()):
            task.cancel()

    async def _run(self, command: str, job: str, arguments: Mapping[str, Any], timeout: float | None) -> None:
        try:
            async with asyncio.timeout(timeout):
                result = await self._commands[command](
                    arguments, lambda phase, fraction: self._events.progress(job, phase, fraction)
                )
            self._events.done(job, json.dumps(result))
        except (LinkError, HopError) as error:
            self._events.failed(job, error.kind, str(error))
        except TimeoutError:
            self._events.failed(job, "unreachable", f"cannot {command}: not done in {timeout:g} s")
        except asyncio.CancelledError:
            raise
        except Exception as error:  # noqa: BLE001 - logged here, and told to the core agent, who must not wait for ever
            _log.exception("%s failed", command)
            self._events.failed(job, "bug", f"cannot {command}: {type(error).__name__}: {error}")
