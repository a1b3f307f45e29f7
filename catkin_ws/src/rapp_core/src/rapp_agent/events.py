"""What a machine tells its listeners."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal["entered", "left", "failed"]


@dataclass(frozen=True)
class Event:
    """One entry, leaving or failure of a state; `path` names the states from the outermost machine down to it."""

    kind: Kind
    machine: str
    state: str
    path: tuple[str, ...]
    detail: str = ""
