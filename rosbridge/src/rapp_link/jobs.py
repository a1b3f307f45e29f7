"""The table of jobs: what the core asked for and has not got yet. Pure; times are handed in.

Rules: the caller chooses the id; an id is used once; at most so many jobs are open; every job has a deadline; every job
ends once, and whoever ends it tells the caller.
"""

import math
import re
from collections import deque
from dataclasses import dataclass

from rapp_hop.errors import Invalid, Refused

_ID = re.compile(r"[A-Za-z0-9_.:/-]{1,128}", re.ASCII)
REMEMBERED = 1000  # ids of ended jobs that are not taken again


@dataclass(frozen=True)
class Job:
    """One thing asked for."""

    id: str
    service: str
    deadline: float  # seconds of the clock that opened it


class JobTable:
    """The open jobs."""

    def __init__(self, capacity: int, longest: float) -> None:
        """Begin with none.

        :param capacity: jobs open at once
        :param longest: seconds a job may take
        """
        self._capacity = capacity
        self._longest = longest
        self._open: dict[str, Job] = {}
        self._ended: deque[str] = deque(maxlen=REMEMBERED)

    def __len__(self) -> int:
        return len(self._open)

    def open(self, job_id: str, service: str, timeout: float, now: float) -> Job:
        """Take a job in.

        :param timeout: seconds
        :raises Invalid: the id or the time-out cannot be used
        :raises Refused: the id was used before, or too many jobs are open
        """
        if not _ID.fullmatch(job_id):
            raise Invalid("cannot take a job without an id: give a unique one of letters, digits and _.:/-")
        if not (math.isfinite(timeout) and timeout > 0):
            raise Invalid(f"cannot finish in {timeout} s: give a time-out above zero")
        if job_id in self._open or job_id in self._ended:
            raise Refused(f"cannot take job {job_id} twice: give each request an id of its own")
        if len(self._open) >= self._capacity:
            raise Refused(f"cannot take more than {self._capacity} jobs at once: wait until one has ended")
        job = Job(job_id, service, now + min(timeout, self._longest))
        self._open[job_id] = job
        return job

    def end(self, job_id: str) -> Job | None:
        """Close a job; None when it is not open, so that only the first of several ends is told."""
        job = self._open.pop(job_id, None)
        if job is not None:
            self._ended.append(job_id)
        return job

    def due(self, now: float) -> list[Job]:
        """Return the open jobs whose deadline has come."""
        return [job for job in self._open.values() if job.deadline <= now]

    def all(self) -> list[Job]:
        """Return the open jobs."""
        return list(self._open.values())
