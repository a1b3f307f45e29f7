"""Machines: steps, terminal conditions, edges, nesting, events, failures."""

import itertools
from collections.abc import Callable

import pytest

from rapp_agent import AgentError, Behaviour, Edge, Event, GraphError, Machine, Subsystem

Note = Callable[[Subsystem], None]


def note(text: str) -> Note:
    """Append to the journal in memory."""

    def write(share: Subsystem) -> None:
        journal = share.memory.setdefault("journal", [])
        assert isinstance(journal, list)
        journal.append(text)

    return write


def raising(text: str) -> Note:
    def fail(_share: Subsystem) -> None:
        raise RuntimeError(text)

    return fail


def framed(name: str, transition: Note | None = None, **more: object) -> Behaviour:
    return Behaviour(name, transition or note(name), on_enter=note(f"+{name}"), on_leave=note(f"-{name}"), **more)  # type: ignore[arg-type]


def chain(name: str, *behaviours: Behaviour | Machine, failure: str | None = None, extra: Behaviour | None = None) -> Machine:
    """Behaviours one after another; `extra` leads to the last."""
    states = {item.name: item for item in behaviours}
    names = list(states)
    edges = [Edge(*pair) for pair in itertools.pairwise(names)]
    if extra is not None:
        states[extra.name] = extra
        edges.append(Edge(extra.name, names[-1]))
    return Machine(name, states, names[0], edges, [names[-1]], failure)


def watched(machine: Machine) -> list[tuple[str, str]]:
    seen: list[tuple[str, str]] = []
    machine.listen(lambda event: seen.append((event.kind, "/".join(event.path))))
    return seen


@pytest.fixture
def share() -> Subsystem:
    return Subsystem("control", memory={"journal": []})


def test_one_step_executes_one_transition_function(share: Subsystem) -> None:
    machine = chain("m", framed("a"), framed("b"))
    assert machine.path == ()
    assert not machine.step(share)
    assert share.memory["journal"] == ["+a", "a", "-a", "+b"]
    assert machine.path == ("b",)
    assert machine.step(share)
    assert share.memory["journal"] == ["+a", "a", "-a", "+b", "b", "-b"]
    assert machine.finished
    assert machine.state is None


def test_a_machine_that_has_ended_does_nothing_until_reset(share: Subsystem) -> None:
    machine = chain("m", framed("a"))
    assert machine.step(share)
    assert machine.step(share)
    assert share.memory["journal"] == ["+a", "a", "-a"]
    machine.reset()
    assert not machine.finished
    assert machine.step(share)
    assert share.memory["journal"] == ["+a", "a", "-a"] * 2


def test_a_transition_function_is_repeated_until_its_terminal_condition_holds(share: Subsystem) -> None:
    thrice = framed("a", terminal=lambda s: s.memory["journal"].count("a") == 3)  # type: ignore[attr-defined]
    machine = chain("m", thrice, framed("b"))
    assert [machine.step(share) for _ in range(4)] == [False, False, False, True]
    assert share.memory["journal"] == ["+a", "a", "a", "a", "-a", "+b", "b", "-b"]


@pytest.mark.parametrize(("way", "goes"), [("left", "b"), ("right", "c"), ("neither", "d")])
def test_edges_are_tried_in_their_order(share: Subsystem, way: str, goes: str) -> None:
    share.memory["way"] = way
    edges = [
        Edge("a", "b", lambda s: s.memory["way"] == "left"),
        Edge("a", "c", lambda s: s.memory["way"] in ("left", "right")),
        Edge("a", "d"),
    ]
    machine = Machine("m", {name: framed(name) for name in "abcd"}, "a", edges, "bcd")
    machine.step(share)
    assert machine.state == goes


def test_no_edge_to_take_is_an_error_not_a_standstill(share: Subsystem) -> None:
    machine = Machine("m", {n: framed(n) for n in "ab"}, "a", [Edge("a", "b", lambda _share: False)], "b")
    with pytest.raises(GraphError, match="cannot go on from a"):
        machine.step(share)


def test_a_nested_machine_is_a_state(share: Subsystem) -> None:
    machine = chain("outer", framed("s1"), chain("s2", framed("s21"), framed("s22")), framed("s3"))
    seen, paths = watched(machine), []
    while not machine.step(share):
        paths.append(machine.path)
    assert paths == [("s2",), ("s2", "s22"), ("s3",)]
    assert [entry for entry in seen if entry[0] == "entered"] == [
        ("entered", "s1"),
        ("entered", "s2"),
        ("entered", "s2/s21"),
        ("entered", "s2/s22"),
        ("entered", "s3"),
    ]
    assert seen.index(("left", "s2/s22")) < seen.index(("left", "s2")) < seen.index(("entered", "s3"))


def test_a_nested_machine_begins_anew_each_time_it_is_entered(share: Subsystem) -> None:
    inner = chain("inner", framed("x"), framed("y"))
    again = Edge("check", "inner", lambda s: s.memory["journal"].count("x") < 2)  # type: ignore[attr-defined]
    states = {"inner": inner, "check": framed("check"), "end": framed("end")}
    machine = Machine("m", states, "inner", [Edge("inner", "check"), again, Edge("check", "end")], ["end"])
    machine.run(share, limit=20)
    journal = share.memory["journal"]
    assert isinstance(journal, list)
    assert [entry for entry in journal if entry in ("x", "y", "check")] == ["x", "y", "check"] * 2


def test_an_event_tells_machine_state_and_label(share: Subsystem) -> None:
    inner = Machine("say", {"speak": Behaviour("speak", note("x"), label="delegate")}, "speak", [], ["speak"])
    machine = Machine("core", {"s9": inner}, "s9", [], ["s9"])
    seen: list[Event] = []
    machine.listen(seen.append)
    machine.step(share)
    assert seen[1] == Event("entered", "say", "speak", ("s9", "speak"), "delegate")


def test_who_unsubscribes_hears_no_more_even_when_it_does_so_twice(share: Subsystem) -> None:
    machine = chain("m", framed("a"), framed("b"))
    seen: list[Event] = []
    first, second = machine.listen(seen.append), machine.listen(seen.append)
    first()
    first()
    machine.step(share)
    assert [event.kind for event in seen] == ["entered", "left", "entered"]
    second()
    machine.step(share)
    assert len(seen) == 3


def test_run_idles_between_steps_and_stops_at_its_limit(share: Subsystem) -> None:
    idles: list[int] = []
    chain("m", framed("a"), framed("b"), framed("c")).run(share, idle=lambda: idles.append(1))
    assert len(idles) == 2
    endless = chain("m", framed("a", terminal=lambda _share: False), framed("b"))
    with pytest.raises(AgentError, match="still in a after 5 steps"):
        endless.run(share, limit=5)


def test_a_failure_leads_to_the_failure_state(share: Subsystem) -> None:
    machine = chain("m", framed("a", raising("boom")), framed("b"), framed("z"), failure="f", extra=framed("f"))
    seen = watched(machine)
    machine.run(share, limit=9)
    assert str(share.memory["error"]) == "boom"
    assert share.memory["journal"] == ["+a", "-a", "+f", "f", "-f", "+z", "z", "-z"]
    assert seen[:4] == [("entered", "a"), ("failed", "a"), ("left", "a"), ("entered", "f")]


def test_a_failure_without_a_failure_state_is_raised_once_and_leaves_the_state(share: Subsystem) -> None:
    machine = chain("m", framed("a", raising("boom")), framed("b"))
    with pytest.raises(RuntimeError, match="boom"):
        machine.step(share)
    assert share.memory["journal"] == ["+a", "-a"]
    with pytest.raises(AgentError, match="reset it first"):
        machine.step(share)
    machine.reset()
    with pytest.raises(RuntimeError, match="boom"):
        machine.step(share)


def test_a_failure_in_a_nested_machine_goes_to_the_outer_failure_state(share: Subsystem) -> None:
    inner = chain("inner", framed("x"), framed("y", raising("boom")))
    machine = chain("outer", inner, framed("z"), failure="f", extra=framed("f"))
    seen = watched(machine)
    machine.run(share, limit=9)
    assert [entry for entry in seen if entry[0] == "failed"] == [("failed", "inner/y"), ("failed", "inner")]
    assert share.memory["journal"] == ["+x", "x", "-x", "+y", "-y", "+f", "f", "-f", "+z", "z", "-z"]


def test_a_failure_of_the_failure_state_is_raised(share: Subsystem) -> None:
    broken = framed("f", raising("second"))
    machine = chain("m", framed("a", raising("first")), framed("z"), failure="f", extra=broken)
    machine.step(share)
    with pytest.raises(RuntimeError, match="second"):
        machine.step(share)


def test_a_failure_on_entering_the_failure_state_is_told_and_raised(share: Subsystem) -> None:
    broken = Behaviour("f", note("f"), on_enter=raising("second"))
    machine = chain("m", framed("a", raising("first")), framed("z"), failure="f", extra=broken)
    seen = watched(machine)
    with pytest.raises(RuntimeError, match="second"):
        machine.step(share)
    assert seen[-2:] == [("entered", "f"), ("failed", "f")]


def test_a_state_that_cannot_be_left_fails_but_is_not_left_twice(share: Subsystem) -> None:
    leaves: list[int] = []

    def leave(_share: Subsystem) -> None:
        leaves.append(1)
        raise RuntimeError("stuck")

    stuck = Behaviour("a", note("a"), on_leave=leave)
    machine = chain("m", stuck, framed("z"), failure="f", extra=framed("f"))
    machine.run(share, limit=9)
    assert leaves == [1]
    assert str(share.memory["error"]) == "stuck"
    assert machine.finished


def test_the_first_error_is_reported_when_leaving_fails_too(share: Subsystem) -> None:
    machine = chain("m", Behaviour("a", raising("first"), on_leave=raising("second")), framed("z"))
    with pytest.raises(RuntimeError, match="first") as raised:
        machine.step(share)
    assert "second" in raised.value.__notes__[0]
