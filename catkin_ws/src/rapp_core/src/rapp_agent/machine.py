"""FSM of behaviours (deliverable section 2): nestable, steppable, its graph checked when it is built."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

from rapp_agent.behaviour import Behaviour, Edge
from rapp_agent.errors import AgentError, GraphError
from rapp_agent.events import Event, Kind
from rapp_agent.graph import check
from rapp_agent.subsystem import Subsystem

Listener = Callable[[Event], None]


class Machine:
    """A graph of states, each a Behaviour or another Machine (a sub-FSM).

    Rules it keeps: one step executes one transition function; a state is left only after its terminal condition held;
    a nested machine is stepped to its final state before its own edges are tried; an exception in a state is told as
    "failed", and leads to the state `failure` with memory["error"] set, or is raised when there is none (the machine is
    then to be reset); `on_leave` runs once for every state that was entered, also for one that fails.
    """

    def __init__(
        self,
        name: str,
        states: Mapping[str, "Behaviour | Machine"],
        initial: str,
        edges: Iterable[Edge],
        finals: Iterable[str],
        failure: str | None = None,
        label: str = "",
    ) -> None:
        self.name = name
        self.states: Mapping[str, Behaviour | Machine] = MappingProxyType(dict(states))
        self.initial = initial
        self.edges = tuple(edges)
        self.finals = frozenset(finals)
        self.failure = failure
        self.label = label
        self._listeners: list[list[Listener]] = []
        self._current: str | None = None
        self._finished = False
        self._leaving = False
        self._broken = False
        check(name, self.states, initial, self.edges, self.finals, failure)
        for state, inner in self.states.items():
            if isinstance(inner, Machine):
                inner.listen(lambda event, state=state: self._forward(state, event))  # type: ignore[misc]

    @property
    def state(self) -> str | None:
        """Name of the current state; None before the first step and after the end."""
        return self._current

    @property
    def path(self) -> tuple[str, ...]:
        """Names of the current states from this machine down to the innermost one."""
        if self._current is None:
            return ()
        inner = self.states[self._current]
        return (self._current, *(inner.path if isinstance(inner, Machine) else ()))

    @property
    def finished(self) -> bool:
        """Whether a final state has ended."""
        return self._finished

    def listen(self, callback: Listener) -> Callable[[], None]:
        """Tell `callback` every event of this machine and those nested in it; gives the function that ends that."""
        entry = [callback]  # an object of its own: one callback may listen twice
        self._listeners.append(entry)

        def unsubscribe() -> None:
            self._listeners = [other for other in self._listeners if other is not entry]

        return unsubscribe

    def reset(self) -> None:
        """Go back to before the first step, without a word to the listeners."""
        self._current = None
        self._finished = self._leaving = self._broken = False
        for inner in self.states.values():
            if isinstance(inner, Machine):
                inner.reset()

    def step(self, subsystem: Subsystem) -> bool:
        """Execute one transition function; gives True when the machine has ended (again and again, until reset).

        Raises what a state raised when there is no `failure` state to go to, then AgentError until reset.
        """
        if self._finished:
            return True
        if self._broken:
            raise AgentError(f"cannot step machine {self.name}: its state {self._current} has failed; reset it first")
        try:
            if self._current is None:
                self._enter(self.initial, subsystem)
            if self._step_state(subsystem):
                self._advance(subsystem)
        except Exception as error:  # noqa: BLE001 - whatever a behaviour raises is the machine's to report
            self._fail(error, subsystem)
        return self._finished

    def run(self, subsystem: Subsystem, idle: Callable[[], None] | None = None, limit: int | None = None) -> None:
        """Step to the end, calling `idle` between steps; raises AgentError after `limit` steps."""
        steps = 0
        while not self.step(subsystem):
            steps += 1
            if limit is not None and steps >= limit:
                raise AgentError(f"cannot end machine {self.name}: still in {'/'.join(self.path)} after {limit} steps")
            if idle is not None:
                idle()

    def _step_state(self, subsystem: Subsystem) -> bool:
        assert self._current is not None
        state = self.states[self._current]
        if isinstance(state, Machine):
            return state.step(subsystem)
        state.transition(subsystem)
        return state.terminal(subsystem)

    def _enter(self, name: str, subsystem: Subsystem) -> None:
        self._current = name
        self._leaving = False
        state = self.states[name]
        self._tell("entered", name, state.label)
        if isinstance(state, Machine):
            state.reset()
        elif state.on_enter is not None:
            state.on_enter(subsystem)

    def _leave(self, subsystem: Subsystem) -> None:
        self._undo(subsystem)
        self._tell("left", str(self._current))

    def _undo(self, subsystem: Subsystem) -> None:
        state = self.states[str(self._current)]
        self._leaving = True
        if isinstance(state, Behaviour) and state.on_leave is not None:
            state.on_leave(subsystem)

    def _advance(self, subsystem: Subsystem) -> None:
        name = self._current
        if name in self.finals:
            self._leave(subsystem)
            self._current = None
            self._finished = True
            return
        for edge in self.edges:
            if edge.source == name and edge.when(subsystem):
                self._leave(subsystem)
                self._enter(edge.target, subsystem)
                return
        raise GraphError(f"cannot go on from {name} of machine {self.name}: no edge's condition holds")

    def _fail(self, error: Exception, subsystem: Subsystem) -> None:
        name = str(self._current)
        self._tell("failed", name, f"{type(error).__name__}: {error}")
        if not self._leaving:
            try:
                self._undo(subsystem)
            except Exception as second:  # noqa: BLE001 - the first error is the one to report
                error.add_note(f"and leaving {name} failed too: {second!r}")
        if self.failure is None or name == self.failure:
            self._broken = True
            raise error
        subsystem.memory["error"] = error
        self._tell("left", name)
        try:
            self._enter(self.failure, subsystem)
        except Exception as second:  # noqa: BLE001 - as in `step`
            self._fail(second, subsystem)

    def _tell(self, kind: Kind, state: str, detail: str = "") -> None:
        self._send(Event(kind, self.name, state, (state,), detail))

    def _forward(self, state: str, event: Event) -> None:
        self._send(Event(event.kind, event.machine, event.state, (state, *event.path), event.detail))

    def _send(self, event: Event) -> None:
        for (listener,) in tuple(self._listeners):
            listener(event)
