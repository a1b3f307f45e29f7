"""One hook for all that happens: states, what was said and heard, messages between agents; log, tests, screens listen."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from rapp_agent import Event

Kind = Literal["entered", "left", "failed", "said", "heard", "message"]
_DYNAMIC_KINDS = ("entered", "left", "failed")  # that a dynamic agent may tell of itself


@dataclass(frozen=True)
class Happening:
    """One thing that happened; `detail` holds the words or the message."""

    agent: str
    machine: str
    state: str
    kind: Kind
    detail: str


class Trace:
    """Tells listeners what happens; `state` is where the core FSM is."""

    def __init__(self) -> None:
        self._listeners: list[Callable[[Happening], None]] = []
        self.state = ""

    def listen(self, listener: Callable[[Happening], None]) -> None:
        """Tell `listener` everything from now on; called from any thread, must return at once."""
        self._listeners.append(listener)

    def core_event(self, event: Event) -> None:
        """An event of the core FSM or of one of its sub-FSMs."""
        if event.kind == "entered" and len(event.path) == 1:
            self.state = event.state
        self.tell(Happening("core", event.machine, event.state, event.kind, event.detail))

    def service_event(self, event: Event) -> None:
        """An event of a core service, a sub-FSM of s9 (or of s3, when the core itself uses it)."""
        self.tell(Happening("core", event.machine, f"{self.state}/{event.state}", event.kind, event.detail))

    def said(self, text: str) -> None:
        """The robot says a text."""
        self.tell(Happening("core", "core", self.state, "said", text))

    def heard(self, text: str) -> None:
        """The robot has recognised a text."""
        self.tell(Happening("core", "core", self.state, "heard", text))

    def call(self, source: str, target: str, text: str) -> None:
        """A message whose sender waits for the reply, to or from the core agent, as in Figs 5 to 12 of the paper."""
        self.message("core", f"{source}->{target} {text}")

    def send(self, source: str, target: str, text: str) -> None:
        """A message whose sender goes on at once."""
        self.message("core", f"{source}->{target} {text} (asynchronous)")

    def reply(self, source: str, target: str, text: str) -> None:
        """A reply to a call."""
        self.message("core", f"{source}->{target} reply {text}")

    def note(self, text: str) -> None:
        """What the core agent has decided or done by itself."""
        self.message("core", f"core: {text}")

    def of_dynamic(self, message: Mapping[str, Any]) -> None:
        """What has passed over a dynamic agent's channel."""
        kind = message["type"]
        if kind == "state" and message.get("kind") in _DYNAMIC_KINDS:
            fields = [str(message.get(name, ""))[:200] for name in ("machine", "state", "kind", "detail")]
            self.tell(Happening("dynamic", fields[0], fields[1], fields[2], fields[3]))  # type: ignore[arg-type]
        elif kind == "activate":
            self.send("core", "dynamic", "activate")
        elif kind != "state":
            self.send("dynamic", "core", kind)

    def message(self, agent: str, text: str) -> None:
        """A message told by the agent that sent or received it, in the form that rapp_msgs/AgentState describes."""
        self.tell(Happening(agent, agent, self.state, "message", text))

    def tell(self, happening: Happening) -> None:
        """Tell all listeners."""
        for listener in self._listeners:
            listener(happening)
