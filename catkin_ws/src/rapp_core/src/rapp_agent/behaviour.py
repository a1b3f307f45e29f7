"""Behaviours and the edges between them (deliverable section 2.1)."""

from collections.abc import Callable
from dataclasses import dataclass

from rapp_agent.subsystem import Subsystem

Transition = Callable[[Subsystem], None]
Condition = Callable[[Subsystem], bool]


def always(_subsystem: Subsystem) -> bool:
    """The condition that always holds."""
    return True


@dataclass(frozen=True)
class Behaviour:
    """Cyclic execution of a transition function until a terminal condition holds.

    Each step calls `transition`, then asks `terminal`; `on_enter` and `on_leave` frame the whole; `label` is for
    drawings and is the detail of the "entered" event.
    """

    name: str
    transition: Transition
    terminal: Condition = always
    on_enter: Transition | None = None
    on_leave: Transition | None = None
    label: str = ""


@dataclass(frozen=True)
class Edge:
    """An edge of a machine's graph, taken when its source has ended and `when` holds; tried in their order."""

    source: str
    target: str
    when: Condition = always
    label: str = ""
