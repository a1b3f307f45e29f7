"""Executes core services: one at a time per resource, cut short when the lease ends."""

import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any

from rapp_core.errors import Refused
from rapp_core.launcher.lease import Grant
from rapp_core.services.context import Context, Reply, execute, subsystem
from rapp_core.services.table import CORE_SERVICES, CoreService

PATIENCE = 10.0  # s a call waits for a resource another call holds


class Executor:
    """Runs the services' sub-FSMs in the callers' threads; counts the dynamic agent's calls that are running."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._services = {service.name: service for service in CORE_SERVICES}
        self._resources = {name: threading.Lock() for service in CORE_SERVICES for name in service.resources}
        self._lock = threading.Lock()
        self._running = 0

    @property
    def busy(self) -> bool:
        """Whether a call of the dynamic agent runs at this moment."""
        return self._running > 0

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Count a dynamic agent's call as running."""
        with self._lock:
            self._running += 1
        try:
            yield
        finally:
            with self._lock:
                self._running -= 1

    def run(self, name: str, **request: Any) -> Reply:
        """Execute one service for the core agent itself; gives its reply. Raises CoreError."""
        return self._execute(name, request, self._context)

    def run_for(self, grant: Grant, name: str, **request: Any) -> Reply:
        """Execute one service for the dynamic agent that holds the lease; cut short when the lease ends. Raises CoreError."""
        run = grant.run
        context = replace(self._context, cut=grant.cut, recordings=run.recordings, package=run.package)
        return self._execute(name, request, context)

    def _execute(self, name: str, request: dict[str, Any], context: Context) -> Reply:
        service = self._services[name]
        with self._held(service):
            return execute(service.machine(context), subsystem(name, **request), context)

    @contextmanager
    def _held(self, service: CoreService) -> Iterator[None]:
        with ExitStack() as stack:
            for name in sorted(service.resources):
                if not self._resources[name].acquire(timeout=PATIENCE):
                    raise Refused(f"cannot run {service.name}: the {name} is in use; wait for the other call")
                stack.callback(self._resources[name].release)
            yield
