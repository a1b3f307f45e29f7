"""What a service's sub-FSM works with: robot, clock, settings, trace, and a way to be cut short."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rapp_agent import Buffer, Machine, Subsystem
from rapp_core.config import Config
from rapp_core.errors import CoreError, Invalid, Refused
from rapp_core.ports import INSIDE_PACKAGE, Robot
from rapp_core.services.calls import Call, Calls
from rapp_core.services.place import Place
from rapp_core.trace import Trace

STEP = 0.02  # s between steps of a service that waits


@dataclass(frozen=True)
class Context:
    """What all services share, and what belongs to the caller of one: its folders, and `cut` and `call`, which end the service."""

    robot: Robot
    config: Config
    trace: Trace
    recordings: Path  # where the caller's recordings go
    package: Path | None = None  # the caller's package, which it sees as `INSIDE_PACKAGE`
    cut: threading.Event = field(default_factory=threading.Event)
    now: Callable[[], float] = time.monotonic
    call: Call = field(default_factory=Call)
    calls: Calls = field(default_factory=Calls)  # of all callers
    place: Place = field(default_factory=Place)  # of the robot

    def check(self) -> None:
        """Raise Refused when the service is to end."""
        if self.cut.is_set():
            raise Refused("cannot finish: the dynamic agent's lease has ended")
        self.call.check()

    def readable(self, seen: str) -> Path:
        """The file behind a path as the caller sees it: of its package or its recordings. Raises Invalid for any other."""
        path = Path(seen)
        if self.package is not None and path.is_relative_to(INSIDE_PACKAGE):
            path = self.package / path.relative_to(INSIDE_PACKAGE)
        path = path.resolve()
        folders = [self.recordings] if self.package is None else [self.recordings, self.package]
        if not any(path.is_relative_to(folder.resolve()) for folder in folders) or not path.is_file():
            raise Invalid(f"cannot read {seen}: give a file of the RApp's package or one of its recordings")
        return path


class Reply(dict[str, Any]):
    """Fields of a service's response."""


def subsystem(name: str, /, **request: Any) -> Subsystem:
    """The control subsystem's share of one service call: an input buffer for what is heard, the request in memory."""
    return Subsystem(name, inputs=[Buffer("heard", 256)], memory={"request": request, "reply": Reply()})


def execute(machine: Machine, share: Subsystem, context: Context) -> Reply:
    """Step a service's sub-FSM to its end; gives the reply. Raises CoreError, Refused when it is cut short."""
    stop = machine.listen(context.trace.service_event)
    try:
        while not machine.step(share):
            wait = share.memory.get("wait")  # for what may end sooner than a step does, such as a motion
            (wait if callable(wait) else context.cut.wait)(STEP)
            context.check()
    finally:
        stop()
        undo = share.memory.get("undo")
        if callable(undo):
            undo()
    error = share.memory.get("error")
    if isinstance(error, CoreError):
        raise error
    reply = share.memory["reply"]
    assert isinstance(reply, Reply)
    return reply


def request(share: Subsystem, name: str) -> Any:
    """A field of the request."""
    fields = share.memory["request"]
    assert isinstance(fields, dict)
    return fields[name]


def reply(share: Subsystem, **fields: Any) -> None:
    """Set fields of the reply."""
    answer = share.memory["reply"]
    assert isinstance(answer, Reply)
    answer.update(fields)
