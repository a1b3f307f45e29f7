"""Both drawings of one run: Mermaid as text, SVG by its shapes."""

from collections.abc import Iterable
from itertools import pairwise
from xml.etree import ElementTree

import pytest

from rapp_cli.trace.layout import lay_out, text_width
from rapp_cli.trace.mermaid import to_mermaid
from rapp_cli.trace.messages import Item
from rapp_cli.trace.participants import participants
from rapp_cli.trace.svg import to_svg

RUN = [
    Item("send", "person", "core", "“<e-mail> & more; #1”", 0.0),
    Item("state", "core", "core", "s4 keyword", 0.5),
    Item("call", "dynamic", "core", "rapp_send_mail", 1.0),
    Item("call", "core", "link", "send_mail", 1.0),
    Item("call", "link", "mail-server", "mail (SMTP)", 1.1),
    Item("note", "link", "link", "the mail is not taken (unreachable)", 1.2),
    Item("reply", "link", "core", "send_mail: kept", 1.3),
    Item("send", "core", "ALAudioRecorder", "start", 1.4, times=2),
    Item("reply", "core", "dynamic", "rapp_send_mail", 1.5),
]


def test_participants_come_in_the_order_of_the_architecture() -> None:
    assert participants(RUN) == ["person", "core", "ALAudioRecorder", "dynamic", "link", "mail-server"]


def test_mermaid() -> None:
    assert to_mermaid(RUN).splitlines() == [
        "sequenceDiagram",
        "    actor person",
        "    participant a_core as core agent",
        "    participant ALAudioRecorder",
        "    participant a_dyn as dynamic agent",
        "    participant a_link as link",
        "    participant a_cloud as cloud agent (mail server)",
        "    person-)a_core: “#60;e-mail#62; & more#59; #35;1”",
        "    Note over a_core: s4 keyword",
        "    a_dyn->>+a_core: rapp_send_mail",
        "    a_core->>+a_link: send_mail",
        "    a_link->>a_cloud: mail (SMTP)",
        "    Note over a_link: the mail is not taken (unreachable)",
        "    a_link-->>-a_core: send_mail: kept",
        "    a_core-)ALAudioRecorder: start (2 times)",
        "    a_core-->>-a_dyn: rapp_send_mail",
    ]


def shapes(drawing: str, tag: str, kind: str) -> list[ElementTree.Element]:
    root = ElementTree.fromstring(drawing)
    return [each for each in root.iter() if each.tag.endswith("}" + tag) and kind in each.get("class", "").split()]


def test_svg_tells_every_word() -> None:
    texts = {each.text for each in ElementTree.fromstring(to_svg(RUN, "a run <1>")).iter() if each.tag.endswith("}text")}
    assert {"a run <1>", "“<e-mail> & more; #1”", "core agent", "send_mail: kept", "start (2 times)", "1.10 s"} <= texts


@pytest.mark.parametrize(("kind", "count"), [("call", 3), ("send", 2), ("reply", 2)])
def test_svg_has_a_line_for_each_message_and_one_in_the_legend(kind: str, count: int) -> None:
    assert len(shapes(to_svg(RUN, ""), "line", kind)) == count + 1


def test_only_synchronous_calls_have_full_heads() -> None:
    assert len(shapes(to_svg(RUN, ""), "polygon", "full")) == 3 + 1


def test_svg_has_a_bar_for_each_call_that_was_replied_to() -> None:
    assert len(shapes(to_svg(RUN, ""), "rect", "bar")) == 2


def test_svg_is_readable_on_dark_ground() -> None:
    assert "prefers-color-scheme: dark" in to_svg(RUN, "")


def test_arrows_point_at_who_is_called() -> None:
    layout = lay_out(RUN)
    arrow = shapes(to_svg(RUN, ""), "line", "call")[0]
    assert float(arrow.get("x1", "")) == pytest.approx(layout.columns["dynamic"], abs=0.1)
    assert float(arrow.get("x2", "")) == pytest.approx(layout.columns["core"], abs=10)


def test_labels_fit_between_their_lifelines() -> None:
    long = "a label that is longer than one line can ever be, so that it has to be broken into several"
    layout = lay_out([*RUN, Item("call", "link", "mail-server", long, 2.0)])
    for row in layout.rows:
        assert max(map(text_width, row.lines)) <= row.right - row.left
    assert " ".join(layout.rows[-1].lines) == long


def increasing(numbers: Iterable[float]) -> bool:
    return all(a < b for a, b in pairwise(numbers))


def test_time_runs_downwards_and_notes_stay_on_the_sheet() -> None:
    layout = lay_out(RUN)
    assert increasing(row.y for row in layout.rows)
    assert increasing(layout.columns.values())
    assert min(row.left for row in layout.rows) > 0
    assert max(row.right for row in layout.rows) < layout.width


def test_a_call_within_a_call_has_a_bar_of_its_own_beside_the_outer_one() -> None:
    nested = [
        Item("call", "dynamic", "core", "a", 0.0), Item("call", "dynamic", "core", "b", 1.0),
        Item("reply", "core", "dynamic", "b", 2.0), Item("reply", "core", "dynamic", "a", 3.0),
    ]  # fmt: skip
    assert [bar.depth for bar in lay_out(nested).bars] == [0, 1]
