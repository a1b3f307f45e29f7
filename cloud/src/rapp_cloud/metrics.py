"""How the platform fares, in numbers for Prometheus: calls by service and status, how long they take, who is here."""

import time
from collections.abc import Callable
from typing import Any

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, generate_latest

from rapp_hop.callers import token_of
from rapp_hop.calls import ServiceJob, note
from rapp_hop.errors import HopError
from rapp_hop.forms import OWN, form_of
from rapp_hop.heads import Head, Job
from rapp_hop.protocol import Body, Form, WireAnswer
from rapp_hop.server import HopServer
from rapp_hop.service import BASE

_BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)  # seconds
OTHER = "other"  # label of what is no service; strangers choose paths, and each label costs memory


class Metrics:
    """The numbers of one platform."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        self._calls = Counter("rapp_calls", "Calls answered", ["service", "status"], registry=self._registry)
        self._seconds = Histogram(
            "rapp_call_seconds", "From a call's head to its answer", ["service"], registry=self._registry, buckets=_BUCKETS
        )
        started = Gauge("rapp_start_time_seconds", "When the platform was started", registry=self._registry)
        started.set_to_current_time()

    def count(self, service: str, status: str, seconds: float) -> None:
        """Note one call."""
        self._calls.labels(service, status).inc()
        self._seconds.labels(service).observe(seconds)

    def show(self, name: str, about: str, value: Callable[[], float]) -> None:
        """Have a number that is asked for when the metrics are read; its function must be quick and not block."""
        Gauge(name, about, registry=self._registry).set_function(value)

    def text(self) -> bytes:
        """Return all of them in Prometheus' text format."""
        return generate_latest(self._registry)


class MeasuredServer(HopServer):
    """A HOP server that counts its calls, and asks of each whether it may be."""

    def __init__(self, metrics: Metrics, admit: Callable[[str | None, str], None], *arguments: Any, **named: Any) -> None:
        """See `HopServer`.

        :param admit: gets token and service (the first word of the path below /hop/), and raises a HopError
        """
        super().__init__(*arguments, **named)
        self._metrics = metrics
        self._admit = admit

    def begin(self, head: Head) -> Job | WireAnswer:
        """See `HopServer`."""
        began = time.monotonic()
        found = self._turned_away(head) or super().begin(head)
        name = _label(head.path, found)
        if isinstance(found, WireAnswer):
            self._metrics.count(name, str(found.status), time.monotonic() - began)
            return found
        return _Measured(found, lambda status: self._metrics.count(name, status, time.monotonic() - began))

    def _turned_away(self, head: Head) -> WireAnswer | None:
        public = any(mount.public and head.path.startswith(mount.prefix) for mount in self._mounts)
        if public or not head.path.startswith(BASE):
            return None
        try:
            self._admit(token_of(head.headers), head.path.removeprefix(BASE).partition("/")[0])
        except HopError as error:
            note(self.brake, head, error)
            return _form(head).write_error(error, None)
        return None


class _Measured:
    """See `heads.Job`."""

    def __init__(self, job: Job, ended: Callable[[str], None]) -> None:
        self.max_body = job.max_body
        self._job = job
        self._ended = ended

    async def run(self, body: Body) -> WireAnswer:
        status = "aborted"
        try:
            answer = await self._job.run(body)
            status = str(answer.status)
            return answer
        finally:
            self._ended(status)

    def failed(self, error: HopError) -> WireAnswer:
        answer = self._job.failed(error)
        self._ended(str(answer.status))
        return answer

    async def done(self) -> None:
        await self._job.done()


def _form(head: Head) -> Form:
    try:
        return form_of(head.method, head.headers, head.query)
    except HopError:
        return OWN


def _label(path: str, found: Job | WireAnswer) -> str:
    if isinstance(found, ServiceJob):
        return path.rstrip("/").rpartition("/")[2]
    if isinstance(found, WireAnswer):
        return OTHER
    return "/".join(path.split("/")[:3]) if path.startswith(("/hop/", "/tuf/")) else path[:20]
