"""Drawings show every state and edge, and are the same each time."""

from rapp_agent import Behaviour, Edge, Machine, to_dot, to_mermaid


def does(name: str, label: str = "") -> Behaviour:
    return Behaviour(name, lambda _share: None, label=label)


def mail() -> Machine:
    inner = Machine("task", {"s31": does("s31", "say"), "s32": does("s32")}, "s31", [Edge("s31", "s32")], ["s32"], label="execute")
    edges = [Edge("s1", "s3", label="when open"), Edge("s3", "s5"), Edge("s4", "s5")]
    states = {"s1": does("s1", 'open "it"; now'), "s3": inner, "s4": does("s4"), "s5": does("s5")}
    return Machine("dynamic", states, "s1", edges, ["s5"], failure="s4")


MERMAID = """\
stateDiagram-v2
    s1 : s1 open #quot;it#quot;, now
    state "s3 execute" as s3 {
        s3_s31 : s31 say
        s3_s32 : s32
        [*] --> s3_s31
        s3_s31 --> s3_s32
        s3_s32 --> [*]
    }
    s4 : s4
    s5 : s5
    [*] --> s1
    s1 --> s3 : when open
    s3 --> s5
    s4 --> s5
    s5 --> [*]
    note right of s4 : every failure leads here
"""


def test_mermaid_draws_all_of_it_nested_machines_too() -> None:
    assert to_mermaid(mail()) == MERMAID


def test_two_machines_built_alike_are_drawn_alike() -> None:
    assert to_mermaid(mail()) == to_mermaid(mail())
    assert to_dot(mail()) == to_dot(mail())


def test_dot_draws_sub_fsms_as_double_circles() -> None:
    lines = to_dot(mail()).splitlines()
    assert '    "s3" [shape=doublecircle, label="s3\\nexecute"];' in lines
    assert '    "s1" [shape=circle, label="s1\\nopen \\"it\\"; now"];' in lines
    assert '    "s5" [shape=circle, label="s5", style="bold"];' in lines
    assert '    "s4" [shape=circle, label="s4", style="dashed"];' in lines
    assert '    "s1" -> "s3" [label="when open"];' in lines
