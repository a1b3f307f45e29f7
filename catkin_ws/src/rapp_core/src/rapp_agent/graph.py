"""The checks of a machine's graph, made when it is built, so that a bad graph never runs."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from rapp_agent.behaviour import Behaviour, Edge, always
from rapp_agent.errors import GraphError


def check(
    name: str,
    states: Mapping[str, object],
    initial: str,
    edges: Sequence[Edge],
    finals: Iterable[str],
    failure: str | None,
) -> None:
    """Raise GraphError for unknown or doubled names, states that cannot be reached or left, edges that are never taken.

    A machine without any final state is sound: it goes round for ever, as the core agent's does.
    """
    finals = set(finals)
    named = {initial, *finals, *(e.source for e in edges), *(e.target for e in edges), *({failure} if failure else ())}
    for unknown in sorted(named - set(states)):
        raise GraphError(f"cannot build machine {name}: {unknown} is no state of it")
    _check_identity(name, states)
    _check_edges(name, edges, finals)
    targets = {state: {e.target for e in edges if e.source == state} for state in states}
    for state in states:
        if not targets[state] and state not in finals:
            raise GraphError(f"cannot build machine {name}: no edge leaves {state}, and it is not final")
    reached = _reachable(initial, targets) | (_reachable(failure, targets) if failure else set())
    for state in states:
        if state not in reached:
            raise GraphError(f"cannot build machine {name}: {state} cannot be reached from {initial}")
        if finals and not _reachable(state, targets) & finals:
            raise GraphError(f"cannot build machine {name}: no final state can be reached from {state}")


def _check_edges(name: str, edges: Sequence[Edge], finals: set[str]) -> None:
    """Each edge must be one that can be taken."""
    closed: dict[str, str] = {}
    for edge in edges:
        never = f"cannot build machine {name}: the edge from {edge.source} to {edge.target} is never taken"
        if edge.source in finals:
            raise GraphError(f"{never}, for {edge.source} is final")
        if edge.source in closed:
            raise GraphError(f"{never}, for the one to {closed[edge.source]} before it always is")
        if edge.when is always:
            closed[edge.source] = edge.target


def _check_identity(name: str, states: Mapping[str, object]) -> None:
    """A behaviour is named as its state; one Machine object cannot be two states, for its position would be shared."""
    for state, inner in states.items():
        if isinstance(inner, Behaviour) and inner.name != state:
            raise GraphError(f"cannot build machine {name}: state {state} holds the behaviour {inner.name}")
    seen: set[int] = set()
    for inner in _machines(states):
        if id(inner) in seen:
            raise GraphError(f"cannot build machine {name}: one machine object is two of its states; build it twice")
        seen.add(id(inner))


def _machines(states: Mapping[str, object]) -> Iterator[object]:
    """All machines nested in these states, at any depth."""
    for inner in states.values():
        deeper = getattr(inner, "states", None)
        if deeper is not None:
            yield inner
            yield from _machines(deeper)


def _reachable(start: str, targets: Mapping[str, set[str]]) -> set[str]:
    reached: set[str] = set()
    waiting = [start]
    while waiting:
        state = waiting.pop()
        if state not in reached:
            reached.add(state)
            waiting += targets[state]
    return reached
