"""Executes core services: one at a time per resource, cut short when the lease ends or the call is ended."""

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any

from rapp_agent import Subsystem
from rapp_core.errors import CoreError, Refused
from rapp_core.launcher.lease import Grant
from rapp_core.services.calls import Call
from rapp_core.services.context import Context, Reply, execute, subsystem
from rapp_core.services.posture import comes_back
from rapp_core.services.table import CORE_SERVICES, PUT_BACK, CoreService

PATIENCE = 10.0  # s a call waits for a resource another call holds
STEP = 0.05  # s between two looks while it does
TAKEN_OVER = "another call has taken over"

_log = logging.getLogger(__name__)


def in_thread(work: Callable[[], None]) -> None:
    """Let work go on beside the caller."""
    threading.Thread(target=work, name="goes on", daemon=True).start()


class Executor:
    """Runs the services' sub-FSMs in the callers' threads; counts the dynamic agent's calls that are running."""

    def __init__(self, context: Context, aside: Callable[[Callable[[], None]], None] = in_thread) -> None:
        """`aside` runs what goes on after a reply."""
        self._context = context
        self._aside = aside
        self._services = {service.name: service for service in CORE_SERVICES}
        self._resources = {name: threading.Lock() for service in CORE_SERVICES for name in service.resources}
        self._lock = threading.Lock()
        self._running = 0
        self._going: dict[str, tuple[Subsystem, Context]] = {}  # what goes on after its reply, by service

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

    def put_back(self) -> None:
        """Leave the robot as it was before a service has moved it the first time, or at rest, its motors off.

        Goes on beside the caller, and makes way for whatever else is to move the robot; nothing when no service has.
        """
        before = self._context.calls.take_before()
        if before is None:
            return
        try:
            posture = before if comes_back(self._context, before) else ""
        except CoreError as error:
            _log.warning("the robot is not back at rest: %s", error)
            self._context.calls.keep_before(before)
            return
        self._aside(lambda: self._come_back(before, posture))

    def _come_back(self, before: str, posture: str) -> None:
        call = Call()
        call.yields = call.puts_back = True
        try:
            self._execute(PUT_BACK, {"posture": posture}, replace(self._context, call=call), preempt=True)
        except CoreError as error:
            _log.log(logging.INFO if call.ended else logging.WARNING, "the robot is not back at rest: %s", error)
            self._context.calls.keep_before(before)

    def run(self, name: str, /, call: Call | None = None, **request: Any) -> Reply:
        """Execute one service for the core agent itself; gives its reply. Raises CoreError."""
        return self._execute(self._services[name], request, replace(self._context, call=call or Call()), preempt=False)

    def run_for(self, grant: Grant, name: str, /, call: Call | None = None, preempt: bool = False, **request: Any) -> Reply:
        """Execute one service for the dynamic agent that holds the lease; cut short when the lease ends. Raises CoreError.

        `preempt`: whatever moves the same limbs is ended rather than waited for.
        """
        run = grant.run
        context = replace(self._context, cut=grant.cut, recordings=run.recordings, package=run.package, call=call or Call())
        return self._execute(self._services[name], request, context, preempt)

    def _execute(self, service: CoreService, request: dict[str, Any], context: Context, preempt: bool) -> Reply:
        share = subsystem(service.name, **request)
        if service.check is not None:
            service.check(context, share)
        context.call.take_over(TAKEN_OVER)
        if self._changes(service, share, context):
            return Reply()
        needed = sorted(service.resources if service.needs is None else service.needs(request))
        with ExitStack() as stack:
            if service.moves:
                stack.enter_context(context.calls.entered(context.call, needed))
            for resource in needed:
                self._take(service, resource, context, preempt)
                stack.callback(self._resources[resource].release)
            context.check()
            reply = execute(service.machine(context), share, context)
            if service.after is not None:
                self._go_on(service, share, context, stack.pop_all())
        return reply

    def _take(self, service: CoreService, resource: str, context: Context, preempt: bool) -> None:
        """Wait for a resource as long as the call is not ended; what goes on after its reply makes way."""
        for _ in range(max(1, round(PATIENCE / STEP))):
            context.check()
            context.calls.make_way(context.call, resource, preempt, TAKEN_OVER)
            if self._resources[resource].acquire(timeout=min(STEP, PATIENCE)):
                return
        raise Refused(f"cannot run {service.name}: the {resource} is in use; wait for the other call")

    def _changes(self, service: CoreService, share: Subsystem, context: Context) -> bool:
        """Whether the request only changes what goes on after an earlier reply to the same caller."""
        with self._lock:
            going = self._going.get(service.name)
        if going is None or going[1].cut is not context.cut or going[1].call.ended:
            return False
        execute(service.machine(context), share, context)
        with self._lock:
            if self._going.get(service.name) is not going:
                return False
            going[0].memory["request"] = share.memory["request"]
        return True

    def _go_on(self, service: CoreService, share: Subsystem, context: Context, held: ExitStack) -> None:
        """Begin what goes on after the reply; it gives back the resources when it ends."""
        assert service.after is not None
        machine, entry = service.after(context), (share, context)
        context.call.yields = True
        with self._lock:
            self._going[service.name] = entry

        def work() -> None:
            try:
                with held:
                    execute(machine, share, context)
            except CoreError as error:
                _log.info("%s: %s", service.name, error)
                context.trace.note(f"{service.name}: {error}")
                if not context.call.ended and not context.cut.is_set():
                    context.calls.note_end(context.cut, str(error))
            finally:
                with self._lock:
                    if self._going.get(service.name) is entry:
                        del self._going[service.name]

        self._aside(work)
