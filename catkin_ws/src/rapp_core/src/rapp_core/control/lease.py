"""The lease: only the dynamic agent that holds it is served; its silence, death or standstill ends it (DESIGN section 3.1)."""

import hmac
import threading
import time
from collections.abc import Callable

from rapp_core.config import Config
from rapp_core.errors import Refused
from rapp_core.launcher.run import Run


class Lease:
    """Held by at most one run. The holder is known by a secret it got over its own channel, not by a name it claims."""

    def __init__(self, config: Config, now: Callable[[], float] = time.monotonic) -> None:
        self._config = config
        self._now = now
        self._lock = threading.Lock()
        self._run: Run | None = None
        self.cut = threading.Event()
        """Set while nobody holds the lease after somebody did: running services end."""

    @property
    def holder(self) -> Run | None:
        """The run that holds the lease."""
        return self._run

    def grant(self, run: Run) -> None:
        """Give the lease to a run."""
        with self._lock:
            self._run = run
            self.cut.clear()

    def release(self) -> None:
        """End the lease; services that still run are cut short."""
        with self._lock:
            self._run = None
            self.cut.set()

    def check(self, secret: object) -> Run:
        """The run that holds the lease; raises Refused when `secret` is not its own."""
        with self._lock:
            run = self._run
        if run is None or not isinstance(secret, str) or not hmac.compare_digest(secret.encode(), run.token.encode()):
            raise Refused("cannot serve this call: only the dynamic agent that holds the core agent's lease is served")
        return run

    def problem(self, serving: bool) -> str | None:
        """What is wrong with the holder, said aloud; None when all is well. `serving`: a core service runs for it."""
        run = self._run
        if run is None:
            return None
        now = self._now()
        if not run.alive:
            return "It has crashed"
        if now - run.heartbeat > self._config.heartbeat:
            return "It does not answer any more"
        if serving:
            run.progress = now
        elif now - run.progress > self._config.hang:
            return "It hangs"
        return None
