"""Executes core services: one at a time per resource, cut short when the lease ends."""

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from rapp_core.errors import Refused
from rapp_core.services.context import Context, Reply, execute, subsystem
from rapp_core.services.table import CORE_SERVICES, CoreService

PATIENCE = 10.0  # s a call waits for a resource another call holds


class Executor:
    """Runs the services' sub-FSMs in the callers' threads; counts those that are running."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._services = {service.name: service for service in CORE_SERVICES}
        self._resources = {name: threading.Lock() for service in CORE_SERVICES for name in service.resources}
        self._lock = threading.Lock()
        self._running = 0

    @property
    def busy(self) -> bool:
        """Whether a service runs at this moment."""
        return self._running > 0

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Count a call that is not a sub-FSM, such as a cloud call, as running."""
        with self._lock:
            self._running += 1
        try:
            yield
        finally:
            with self._lock:
                self._running -= 1

    def run(self, name: str, **request: Any) -> Reply:
        """Execute one service; gives its reply. Raises CoreError."""
        service = self._services[name]
        with self.counted(), self._held(service):
            return execute(service.machine(self._context), subsystem(name, **request), self._context)

    @contextmanager
    def _held(self, service: CoreService) -> Iterator[None]:
        with ExitStack() as stack:
            for name in sorted(service.resources):
                if not self._resources[name].acquire(timeout=PATIENCE):
                    raise Refused(f"cannot run {service.name}: the {name} is in use; wait for the other call")
                stack.callback(self._resources[name].release)
            yield
