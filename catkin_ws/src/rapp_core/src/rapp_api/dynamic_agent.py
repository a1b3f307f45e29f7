"""The skeleton of every dynamic agent (paper Fig. 3): s1 and s5 are the same for all, s2 to s4 are the author's."""

from collections.abc import Callable
from typing import Any

from rapp_agent import Behaviour, Edge, Event, Machine, Subsystem
from rapp_api.core_agent import activity


class DynamicAgent:
    """Derive from it, and override `execute` or `task`, and where needed `initialise`, `terminate` and `dismantle`.

    `parameters` are those of package.json.
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

    def machine(self, open_channel: Callable[[], None], send_terminate: Callable[[Exception | None], None]) -> Machine:
        """The agent's FSM; an error in s2 or s3 leads to s4, and is reported by s5."""
        task = self.task() or Machine(
            "execute", {"execute": _doing("execute", self.execute)}, "execute", [], ["execute"], label="execute"
        )

        def send(share: Subsystem) -> None:
            error = share.memory.get("error")
            send_terminate(error if isinstance(error, Exception) else None)

        states: dict[str, Behaviour | Machine] = {
            "s1": _doing("s1", open_channel, "open channel"),
            "s2": _doing("s2", self.initialise, "initialise"),
            "s3": task,
            "s4": _doing("s4", self.terminate, "terminate"),
            "s5": Behaviour("s5", send, label="send terminate"),
        }
        edges = [Edge("s1", "s2"), Edge("s2", "s3"), Edge("s3", "s4"), Edge("s4", "s5")]
        return Machine("dynamic", states, "s1", edges, ["s5"], failure="s4")

    def run(
        self,
        open_channel: Callable[[], None] = lambda: None,
        send_terminate: Callable[[Exception | None], None] = lambda _error: None,
        on_event: Callable[[Event], None] = lambda _event: None,
    ) -> None:
        """Step the FSM to its end, counting each step as activity."""
        machine = self.machine(open_channel, send_terminate)
        machine.listen(on_event)
        machine.run(Subsystem("dynamic"), idle=activity.moved)


def _doing(name: str, work: Callable[[], None], label: str = "") -> Behaviour:
    return Behaviour(name, lambda _share: work(), label=label)
