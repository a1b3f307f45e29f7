"""Who takes part in a diagram, in the order of the lifelines, and what they are called there."""

from collections.abc import Sequence

from rapp_cli.trace.messages import Item

NAMES = {
    "person": "person",
    "core": "core agent",
    "dynamic": "dynamic agent",
    "link": "link",
    "repository": "repository agent",
    "cloud-agent": "cloud agent",
    "mail-server": "cloud agent (mail server)",
}
_BEFORE_MODULES = ("person", "core")


def participants(items: Sequence[Item]) -> list[str]:
    """The robot's modules, its virtual effectors and receptors, come after the core agent, in the order of their first message."""
    present = dict.fromkeys(name for item in items for name in (item.source, item.target))
    first = [name for name in _BEFORE_MODULES if name in present]
    modules = [name for name in present if name not in NAMES]
    return [*first, *modules, *(name for name in NAMES if name in present and name not in _BEFORE_MODULES)]
