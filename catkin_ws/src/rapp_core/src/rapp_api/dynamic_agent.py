"""The skeleton of every dynamic agent (paper Fig. 3): s1 and s5 are the same for all, s2 to s4 are the author's."""

import time
from collections.abc import Callable
from typing import Any

from rapp_agent import Behaviour, Edge, Event, Machine, Subsystem
from rapp_api.core_agent import activity, current

PERIOD = 0.02  # s between two steps of a behaviour whose terminal condition does not hold yet


class DynamicAgent:
    """Derive from it, and override `execute` or `task`, and where needed `initialise`, `terminate` and `dismantle`.

    `parameters` are those of package.json. The core agent ends a RApp whose own loop stands still too long (10 s): core
    services may take their time, anything else that waits uses `pause`.
    """

    def __init__(self, parameters: dict[str, Any] | None = None) -> None:
        self.parameters = dict(parameters or {})

    def initialise(self) -> None:
        """s2: prepare what the task needs."""

    def execute(self) -> None:
        """s3: the task, when it is no FSM of its own."""

    def task(self) -> Machine | None:
        """s3 as an FSM nested into the agent's; None when `execute` is the task."""
        return None

    def terminate(self) -> None:
        """s4: tidy up; also called after a failure."""

    def dismantle(self) -> None:
        """Stop what this agent has started elsewhere; the core agent waits for the end of it (deliverable section 3.2)."""

    def pause(self, seconds: float) -> None:
        """Let time pass without being taken for hung, as `time.sleep` would be."""
        current().pause(seconds)

    def machine(self, open_channel: Callable[[], None], send_terminate: Callable[[Exception | None], None]) -> Machine:
        """The agent's FSM; an error in s2 or s3 leads to s4, and is reported by s5."""
        task = self.task() or Machine(
            "execute", {"execute": _doing("execute", self.execute)}, "execute", [], ["execute"], label="execute"
        )

        def terminate(share: Subsystem) -> None:
            error = share.memory.get("error")
            if share.memory.get("sending") and isinstance(error, Exception):
                raise error  # s5 itself has failed: there is nobody to tell
            self.terminate()

        def send(share: Subsystem) -> None:
            error = share.memory.get("error")
            share.memory["sending"] = True
            send_terminate(error if isinstance(error, Exception) else None)

        states: dict[str, Behaviour | Machine] = {
            "s1": _doing("s1", open_channel, "open channel"),
            "s2": _doing("s2", self.initialise, "initialise"),
            "s3": task,
            "s4": Behaviour("s4", terminate, label="terminate"),
            "s5": Behaviour("s5", send, label="send terminate"),
        }
        edges = [Edge("s1", "s2"), Edge("s2", "s3"), Edge("s3", "s4"), Edge("s4", "s5")]
        return Machine("dynamic", states, "s1", edges, ["s5"], failure="s4")

    def run(
        self,
        open_channel: Callable[[], None] = lambda: None,
        send_terminate: Callable[[Exception | None], None] | None = None,
        on_event: Callable[[Event], None] = lambda _event: None,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        """Step the FSM to its end in this thread; what `execute` raises goes to `send_terminate`, or is raised without one."""
        machine = self.machine(open_channel, send_terminate or _raise)
        machine.listen(on_event)
        before: list[tuple[str, ...]] = [()]

        def idle() -> None:
            activity.moved()
            if machine.path == before[0]:
                wait(PERIOD)
            before[0] = machine.path

        activity.begin()
        machine.run(Subsystem("dynamic"), idle)


def _doing(name: str, work: Callable[[], None], label: str = "") -> Behaviour:
    return Behaviour(name, lambda _share: work(), label=label)


def _raise(error: Exception | None) -> None:
    if error is not None:
        raise error
