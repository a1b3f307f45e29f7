"""The certificate a platform shows: taken anew when its files change, its end told in time.

What is wrong with new files is logged, and the certificate of before stays; so does every connection that is open.
"""

import asyncio
import logging
import ssl
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from rapp_cloud.tls import WARNING, server_tls, validity
from rapp_hop.errors import HopError, Invalid

LOOK = 1.0  # seconds between two looks at the files
REMIND = 86400.0  # seconds between two warnings that it ends
_log = logging.getLogger(__name__)


class Certificate:
    """Certificate and key of one platform. `look` is blocking, and called from one thread at a time."""

    def __init__(self, certificate: Path, key: Path, clock: Callable[[], float] = time.time) -> None:
        """Take the files as they are.

        :param clock: wall time
        :raises HopError: see `server_tls`
        """
        self.name = certificate.name
        self._files = certificate, key
        self._clock = clock
        self._taken = self._seen = _state(self._files)
        self._told: tuple[list[tuple[int, ...]], str] | None = None  # what was wrong with which files
        self._reminded: float | None = None
        self.context = server_tls(certificate, key)
        self.until = validity(certificate)[1]  # UTC, seconds since 1970
        self._shown = self.context
        # Called in each handshake, whether the client names a server or not: so the one shown can change at any time.
        self.context.sni_callback = self._show

    def left(self) -> float:
        """Return in how many seconds it expires; below zero when it has."""
        return self.until - self._clock()

    @property
    def end(self) -> str:
        """When it expires, for people."""
        return f"{datetime.fromtimestamp(self.until, UTC):%F %T} UTC"

    async def keep(self) -> None:
        """Look now and then, until cancelled."""
        while True:
            await asyncio.to_thread(self.look)
            await asyncio.sleep(LOOK)

    def look(self) -> None:
        """Take the files when they have changed and lie still; warn when the end is near."""
        state, before = _state(self._files), self._seen
        self._seen = state
        if state != self._taken and state == before:  # else somebody may still be writing
            self._renew(state)
        self._warn()

    def _renew(self, state: list[tuple[int, ...]]) -> None:
        """Take the files, or say once what is wrong: they may be good a while later, though nothing changes in them."""
        try:
            context, (since, until) = server_tls(*self._files), validity(self._files[0])
            if not since <= self._clock() < until:
                raise Invalid(f"cannot use {self._files[0]}: it has expired or is not good yet, put one there that is good now")
        except HopError as error:
            if self._told != (state, str(error)):
                _log.error("%s; meanwhile the certificate of before stays, good until %s", error, self.end)
            self._told = state, str(error)
            return
        self._taken, self._told = state, None
        self._shown, self.until, self._reminded = context, until, None
        _log.info("certificate: %s is new, good until %s", self.name, self.end)

    def _warn(self) -> None:
        now = self._clock()
        if self.left() > WARNING or (self._reminded is not None and now - self._reminded < REMIND):
            return
        self._reminded = now
        if self.left() > 0:
            _log.warning("the certificate expires at %s: renew %s, no restart is needed", self.end, self._files[0])
        else:
            _log.error("the certificate has expired at %s and nobody trusts it: renew %s", self.end, self._files[0])

    def _show(self, line: ssl.SSLSocket | ssl.SSLObject, _name: str, _context: ssl.SSLContext) -> None:
        line.context = self._shown


def _state(files: tuple[Path, Path]) -> list[tuple[int, ...]]:
    found: list[tuple[int, ...]] = []
    for path in files:
        try:
            stat = path.stat()
            found.append((stat.st_ino, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns))
        except OSError:
            found.append(())
    return found
