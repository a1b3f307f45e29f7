"""A run as text for Mermaid: `sequenceDiagram`."""

from collections.abc import Sequence

from rapp_cli.trace.messages import Item, pairs
from rapp_cli.trace.participants import NAMES, participants

IDS = {"core": "a_core", "dynamic": "a_dyn", "link": "a_link", "repository": "a_rep", "mail-server": "a_cloud"}
"""The paper's names; Mermaid takes `link` for a word of its own."""
ARROWS = {"call": "->>", "send": "-)", "reply": "-->>"}


def to_mermaid(items: Sequence[Item]) -> str:
    """The diagram, one line per participant and item; calls that were replied to activate their lifelines."""
    found = pairs(items)
    marks = {index: "+" for index, _ in found} | {index: "-" for _, index in found}
    lines = ["sequenceDiagram", *(_participant(name) for name in participants(items))]
    for index, item in enumerate(items):
        if item.kind in ARROWS:
            arrow = ARROWS[item.kind] + marks.get(index, "")
            lines.append(f"{_id(item.source)}{arrow}{_id(item.target)}: {_escaped(item.label)}")
        else:
            lines.append(f"Note over {_id(item.source)}: {_escaped(item.label)}")
    return "\n    ".join(lines) + "\n"


def _participant(name: str) -> str:
    known = f" as {_escaped(NAMES[name])}" if NAMES.get(name, name) != _id(name) else ""
    return f"{'actor' if name == 'person' else 'participant'} {_id(name)}{known}"


def _id(name: str) -> str:
    return IDS.get(name, name.replace("-", "_"))


def _escaped(text: str) -> str:
    """Mermaid takes ; as the end of a line, # as the beginning of a character's code, and < as HTML."""
    return "".join(f"#{ord(c)};" if c in ";#<>" else c for c in text)
