"""A machine whose graph is not sound cannot be built."""

from collections.abc import Iterable

import pytest

from rapp_agent import Behaviour, Edge, GraphError, Machine, Subsystem


def does(name: str) -> Behaviour:
    return Behaviour(name, lambda _share: None)


def machine(
    names: str, edges: Iterable[Edge], initial: str = "a", finals: Iterable[str] = ("z",), failure: str | None = None
) -> Machine:
    return Machine("m", {name: does(name) for name in names}, initial, edges, finals, failure)


def sometimes(_share: Subsystem) -> bool:
    return False


def test_a_sound_graph_is_built() -> None:
    assert machine("abz", [Edge("a", "b", sometimes), Edge("a", "z"), Edge("b", "a")]).state is None


def test_a_machine_without_an_end_goes_round() -> None:
    assert machine("ab", [Edge("a", "b"), Edge("b", "a")], finals=()).finals == frozenset()


@pytest.mark.parametrize(
    ("edges", "changes", "says"),
    [
        ([Edge("a", "z"), Edge("a", "q", sometimes)], {}, "q is no state"),
        ([Edge("q", "a"), Edge("a", "z")], {}, "q is no state"),
        ([Edge("a", "z")], {"initial": "q"}, "q is no state"),
        ([Edge("a", "z")], {"finals": ["z", "q"]}, "q is no state"),
        ([Edge("a", "z")], {"failure": "q"}, "q is no state"),
        ([Edge("a", "z")], {"names": "abz"}, "no edge leaves b"),
        ([Edge("a", "z"), Edge("b", "z")], {"names": "abz"}, "b cannot be reached"),
        ([Edge("a", "b"), Edge("b", "a")], {"names": "abz"}, "no final state can be reached from a"),
        ([Edge("a", "b", sometimes), Edge("a", "z"), Edge("b", "b")], {"names": "abz"}, "no final state can be reached from b"),
        ([Edge("a", "z"), Edge("z", "a")], {}, "z is final"),
        ([Edge("a", "z"), Edge("a", "a", sometimes)], {}, "the one to z before it always is"),
    ],
)
def test_an_unsound_graph_is_refused(edges: list[Edge], changes: dict[str, object], says: str) -> None:
    with pytest.raises(GraphError, match=says):
        machine(**{"names": "az", "edges": edges, **changes})  # type: ignore[arg-type]


def test_a_state_reached_by_failure_alone_is_reached() -> None:
    built = machine("afz", [Edge("a", "z"), Edge("f", "z")], failure="f")
    assert built.failure == "f"
    with pytest.raises(GraphError, match="f cannot be reached"):
        machine("afz", [Edge("a", "z"), Edge("f", "z")])


def test_a_behaviour_is_named_as_its_state() -> None:
    with pytest.raises(GraphError, match="state a holds the behaviour b"):
        Machine("m", {"a": does("b")}, "a", [], ["a"])


def test_one_machine_object_is_one_state_at_any_depth() -> None:
    def around(inner: Machine) -> Machine:
        return Machine("around", {"in": inner}, "in", [], ["in"])

    inner = Machine("inner", {"a": does("a")}, "a", [], ["a"])
    for states in ({"s": inner, "t": inner}, {"s": around(inner), "t": inner}, {"s": around(inner), "t": around(inner)}):
        with pytest.raises(GraphError, match="build it twice"):
            Machine("m", states, "s", [Edge("s", "t")], ["t"])
