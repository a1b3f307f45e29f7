"""The checks of a machine's graph, made when it is built, so that a bad graph never runs."""

from collections.abc import Iterable, Mapping, Sequence

from rapp_agent.behaviour import Edge
from rapp_agent.errors import GraphError


def check(
    name: str,
    states: Mapping[str, object],
    initial: str,
    edges: Sequence[Edge],
    finals: Iterable[str],
    failure: str | None,
) -> None:
    """Raise GraphError for unknown names, unreachable states, dead ends, or a machine that cannot end."""
    finals = set(finals)
    named = {initial, *finals, *(e.source for e in edges), *(e.target for e in edges), *({failure} if failure else ())}
    for unknown in sorted(named - set(states)):
        raise GraphError(f"cannot build machine {name}: {unknown} is no state of it")
    _check_identity(name, states)
    targets = {state: {e.target for e in edges if e.source == state} for state in states}
    for state in states:
        if not targets[state] and state not in finals:
            raise GraphError(f"cannot build machine {name}: no edge leaves {state}, and it is not final")
    reached = _reachable(initial, targets) | (_reachable(failure, targets) if failure else set())
    for state in states:
        if state not in reached:
            raise GraphError(f"cannot build machine {name}: {state} cannot be reached from {initial}")
    for state in states:
        if finals and not _reachable(state, targets) & finals:
            raise GraphError(f"cannot build machine {name}: no final state can be reached from {state}")


def _check_identity(name: str, states: Mapping[str, object]) -> None:
    """One Machine object cannot be two states: its position would be shared."""
    seen: set[int] = set()
    for state, inner in states.items():
        if hasattr(inner, "step") and id(inner) in seen:
            raise GraphError(f"cannot build machine {name}: {state} is the same machine as another state")
        seen.add(id(inner))


def _reachable(start: str, targets: Mapping[str, set[str]]) -> set[str]:
    reached: set[str] = set()
    waiting = [start]
    while waiting:
        state = waiting.pop()
        if state not in reached:
            reached.add(state)
            waiting += targets[state]
    return reached
