"""`/healthz` (it lives), `/readyz` (it can serve, else 503 with the reasons), `/metrics` (Prometheus).

Health is told to everybody; metrics to this computer, or to whoever has a token. Answers are kept for a moment, so that
being asked often costs nothing.
"""

import asyncio
import json
import shutil
import time
from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from rapp_cloud.certificate import Certificate
from rapp_cloud.memory import Memory
from rapp_cloud.metrics import Metrics
from rapp_cloud.tls import is_here
from rapp_hop import strict_json
from rapp_hop.callers import token_of
from rapp_hop.errors import HopError, Refused, Unreachable
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer
from rapp_hop.service import Authenticate

KEPT = 0.5  # seconds that an answer is good
PATIENCE = 10.0  # seconds for all checks; the database may take half of it to say that it is locked
LEAST_DISK = 64 * 2**20  # bytes that must be free
_MAX_TIMESTAMP = 64 * 1024  # bytes
_GET = frozenset({"GET", "HEAD"})
_PROMETHEUS = "text/plain; version=1.0.0; charset=utf-8; escaping=underscores"

Check = Callable[[], None]
"""Raises a HopError or OSError when something is not as it must be; blocking."""


def health(
    checks: Sequence[Check], metrics: Metrics, authenticate: Authenticate, certificate: Certificate | None = None
) -> list[Mount]:
    """Make the three."""

    async def healthz() -> WireAnswer:
        return _json(200, {"alive": True})

    async def readyz() -> WireAnswer:
        try:
            async with asyncio.timeout(PATIENCE):
                reasons = await asyncio.to_thread(_reasons, checks)
        except TimeoutError:
            reasons = [f"cannot tell within {PATIENCE:g} s: try again later"]
        until = {"certificate_expires": certificate.end} if certificate else {}
        return _json(503 if reasons else 200, {"ready": not reasons, "reasons": reasons, **until})

    async def read_metrics() -> WireAnswer:
        return WireAnswer(200, _PROMETHEUS, await asyncio.to_thread(metrics.text))

    def may_read(visit: Visit) -> bool:
        headers = visit.request.headers
        return is_here(visit.address, headers) or authenticate(token_of(headers)) is not None

    return [
        _page("/healthz", healthz, lambda _visit: True),
        _page("/readyz", _Kept(readyz), lambda _visit: True),
        _page("/metrics", _Kept(read_metrics), may_read),
    ]


def checks_of(memory: Memory, data: Path, timestamp: Path, certificate: Certificate | None) -> list[Check]:
    """Return what must be so that the platform can serve."""

    def store() -> None:
        signed = strict_json.loads(timestamp.read_bytes(), limit=_MAX_TIMESTAMP)["signed"]
        if datetime.fromisoformat(signed["expires"]) < datetime.now(UTC):
            raise Unreachable("cannot serve the store: its timestamp has expired, see the log")

    def disk() -> None:
        if shutil.disk_usage(data).free < LEAST_DISK:
            raise Unreachable(f"cannot keep anything more: the disk has less than {LEAST_DISK // 2**20} MiB left, free some space")

    def tls() -> None:
        if certificate is not None and certificate.left() < 0:
            raise Unreachable(f"cannot be trusted: {certificate.name} has expired at {certificate.end}, put a new one in its place")

    return [memory.database.check, memory.check, store, disk, tls]


class _Kept:
    """Makes an answer at most once in `KEPT` seconds, however many ask at once."""

    def __init__(self, make: Callable[[], Awaitable[WireAnswer]]) -> None:
        self._make = make
        self._lock = asyncio.Lock()
        self._answer: tuple[float, WireAnswer] | None = None

    async def __call__(self) -> WireAnswer:
        async with self._lock:
            if self._answer is None or time.monotonic() - self._answer[0] > KEPT:
                answer = await self._make()
                self._answer = time.monotonic(), answer
            return self._answer[1]


def _page(path: str, make: Callable[[], Awaitable[WireAnswer]], allows: Callable[[Visit], bool]) -> Mount:
    async def answer(visit: Visit) -> WireAnswer:
        if visit.rest:
            raise Refused(f"cannot find this page: there is {path}", 404)
        if not allows(visit):
            raise Refused("cannot show this to everybody: send a valid Accept-Token", 401)
        return await make()

    return Mount(path, answer, public=True, methods=_GET)


def _reasons(checks: Sequence[Check]) -> list[str]:
    found = []
    for check in checks:
        try:
            check()
        except HopError as error:
            found.append(str(error))
        except OSError as error:
            found.append(f"cannot read {Path(error.filename or '').name}: {error.strerror}")
    return found


def _json(status: int, value: object) -> WireAnswer:
    return WireAnswer(status, "application/json", json.dumps(value).encode(), (("Cache-Control", "no-store"),))
