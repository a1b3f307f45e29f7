"""Where jobs are worked on: takes a request, runs its command as a task, tells the outcome exactly once.

All in the loop's thread. A deadline is kept even by a command that does not end when cancelled: its late result is
dropped.
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from rapp_hop import strict_json
from rapp_hop.errors import Bug, HopError, Invalid, Refused, Unreachable
from rapp_link import events
from rapp_link.events import Event
from rapp_link.jobs import Job, JobTable

MAX_ARGUMENTS = 256 * 2**10  # bytes; across rosbridge go names, numbers, short texts and paths
MAX_RESULT = 2**20  # bytes

_log = logging.getLogger(__name__)


class Ticket:
    """What a command knows of its job."""

    def __init__(self, job: Job, tell: Callable[[Event], None]) -> None:
        self._job = job
        self._tell = tell
        self._last: tuple[str, int] | None = None

    @property
    def remaining(self) -> float:
        """Seconds to the deadline."""
        return self._job.deadline - asyncio.get_running_loop().time()

    def progress(self, phase: str, fraction: float = 0.0) -> None:
        """Tell how far the job is; not more than 20 times in one phase."""
        step = (phase, int(fraction * 20))
        if step != self._last:
            self._last = step
            self._tell(events.progress(self._job.id, phase, fraction))


Command = Callable[[dict[str, Any], Ticket], Awaitable[Any]]


class Office:
    """The link's jobs and the commands that do them."""

    def __init__(self, table: JobTable, commands: Mapping[str, Command], tell: Callable[[Event], None]) -> None:
        """Prepare.

        :param commands: by service name
        :param tell: publishes an event
        """
        self._table = table
        self._commands = commands
        self._tell = tell
        self._tasks: dict[str, asyncio.Task[str]] = {}
        self._timers: dict[str, asyncio.TimerHandle] = {}

    def request(self, service: str, job_id: str, arguments: str, timeout: float) -> Job:
        """Take a job in and begin it; its outcome comes as an event.

        :param timeout: seconds
        :raises HopError: why it is not taken
        """
        loop = asyncio.get_running_loop()
        command = self._commands.get(service)
        if command is None:
            raise Refused(f"cannot do {service!r}: the link does not offer it")
        fields = strict_json.loads(arguments or "{}", limit=MAX_ARGUMENTS)
        if not isinstance(fields, dict):
            raise Invalid(f"cannot {service}: give the arguments as one JSON object")
        job = self._table.open(job_id, service, timeout, loop.time())
        task = loop.create_task(self._work(command, fields, Ticket(job, self._while_open)), name=f"{service} {job_id}")
        self._tasks[job.id] = task
        self._timers[job.id] = loop.call_at(job.deadline, self._expire, job)
        task.add_done_callback(lambda done: self._finish(job, done))
        return job

    def cancel(self, job_id: str) -> None:
        """End a job because nobody wants it any more; one that is not open is fine."""
        self._stop(job_id, Refused("cannot finish: the job was cancelled"))

    async def close(self) -> None:
        """End all jobs."""
        tasks = list(self._tasks.values())
        for job in self._table.all():
            self._stop(job.id, Unreachable(f"cannot {job.service}: the link ends, try again when it is back"))
        if tasks:
            await asyncio.wait(tasks, timeout=0.5)

    async def _work(self, command: Command, fields: dict[str, Any], ticket: Ticket) -> str:
        text = strict_json.dumps(await command(fields, ticket))
        if len(text) > MAX_RESULT:
            raise Refused(f"cannot hand over a result of {len(text)} characters: ask for less")
        return text

    def _expire(self, job: Job) -> None:
        self._stop(job.id, Unreachable(f"cannot {job.service} in time: no answer came, try again later"))

    def _stop(self, job_id: str, why: HopError) -> None:
        if self._end(job_id, events.failed(job_id, why)):
            self._tasks[job_id].cancel()

    def _finish(self, job: Job, task: asyncio.Task[str]) -> None:
        del self._tasks[job.id]
        if task.cancelled():
            self._end(job.id, events.failed(job.id, Bug(f"cannot {job.service}: it was stopped")))
            return
        error = task.exception()
        if error is None:
            self._end(job.id, events.done(job.id, task.result()))
        elif isinstance(error, HopError):
            self._end(job.id, events.failed(job.id, error))
        else:
            _log.error("%s failed", job.service, exc_info=error)
            self._end(job.id, events.failed(job.id, Bug(f"cannot {job.service}: a fault of the link, see its log")))

    def _end(self, job_id: str, event: Event) -> bool:
        job = self._table.end(job_id)
        if job is None:
            return False
        self._timers.pop(job_id).cancel()
        _log.info("%s %s: %s", job.service, job_id, event.message or "done")
        self._tell(event)
        return True

    def _while_open(self, event: Event) -> None:
        if any(job.id == event.job for job in self._table.all()):
            self._tell(event)
