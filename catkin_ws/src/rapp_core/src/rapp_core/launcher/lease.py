"""The lease: only the dynamic agent that holds it is served; its silence, death or standstill ends it (DESIGN section 3.1)."""

import hmac
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from rapp_core.config import Config
from rapp_core.errors import Refused
from rapp_core.ports import Agent

CRASHED = "It has crashed"
SILENT = "It does not answer any more"
HANGS = "It hangs"
AWAY = 0.5  # s between two looks above which it is the core agent that has stood still


@dataclass(frozen=True)
class Grant:
    """One lease of one run; `cut` is set when it ends, and ends the services that still run for it."""

    run: Agent
    cut: threading.Event = field(default_factory=threading.Event)


class Lease:
    """Held by at most one run. The holder is known by a secret it got over its own channel, not by a name it claims."""

    def __init__(self, config: Config, now: Callable[[], float] = time.monotonic) -> None:
        self._config = config
        self._now = now
        self._lock = threading.Lock()
        self._grant: Grant | None = None
        self._looked = self._back = now()  # when `problem` was last asked, and first after the core agent stood still

    @property
    def held(self) -> bool:
        """Whether a run holds it."""
        return self._grant is not None

    def grant(self, run: Agent) -> None:
        """Give the lease to a run; whoever held it before holds it no more."""
        self.release()
        with self._lock:
            self._grant = Grant(run)
            self._looked = self._now()

    def release(self) -> None:
        """End the lease; services that still run are cut short."""
        with self._lock:
            grant, self._grant = self._grant, None
        if grant is not None:
            grant.cut.set()

    def check(self, secret: object) -> Grant:
        """The present lease; raises Refused when `secret` is not its holder's."""
        with self._lock:
            grant = self._grant
        if grant is None or not isinstance(secret, str) or not hmac.compare_digest(secret.encode(), grant.run.token.encode()):
            raise Refused("cannot serve this call: only the dynamic agent that holds the core agent's lease is served")
        return grant

    def problem(self, serving: bool) -> str | None:
        """What is wrong with the holder, said aloud; None when all is well. `serving`: a core service runs for it.

        To be asked all the time: what a holder has said while nobody looked may not have been read yet; silence counts anew then.
        """
        with self._lock:
            grant = self._grant
        if grant is None:
            return None
        run, now = grant.run, self._now()
        if now - self._looked > AWAY:
            self._back = now
        self._looked = now
        if not run.alive:
            return CRASHED
        if now - max(run.heartbeat, self._back) > self._config.heartbeat:
            return SILENT
        if serving and run.waits:
            run.progress = now
        elif now - max(run.progress, self._back) > self._config.hang:
            return HANGS
        return None
