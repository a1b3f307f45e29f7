"""What the core is told of a job, and of the link's messages to others: rapp_msgs/HopEvent as a value. Pure."""

import json
from dataclasses import dataclass
from typing import Any

from rapp_hop.errors import HopError

PROGRESS, DONE, FAILED, MESSAGE = 0, 1, 2, 3  # rapp_msgs/HopEvent


@dataclass(frozen=True)
class Event:
    """Progress or end of one job, or a message that belongs to none."""

    job: str
    kind: int
    phase: str = ""
    fraction: float = 0.0  # 0..1 of the phase
    error: str = ""
    message: str = ""
    result: str = ""  # JSON; of a failed job an object with the error's reason, where it has one

    def fields(self) -> dict[str, Any]:
        """Return the fields of the ROS message."""
        return dict(vars(self))


def progress(job: str, phase: str, fraction: float) -> Event:
    """Tell how far a job is."""
    return Event(job, PROGRESS, phase=phase, fraction=min(1.0, max(0.0, fraction)))


def done(job: str, result: str) -> Event:
    """Tell a result (JSON)."""
    return Event(job, DONE, result=result)


def failed(job: str, error: HopError) -> Event:
    """Tell why there is none."""
    result = json.dumps({"reason": error.reason}) if error.reason else ""
    return Event(job, FAILED, error=error.kind, message=str(error), result=result)


def message(text: str) -> Event:
    """Tell a message between the link and another agent."""
    return Event("", MESSAGE, message=text)
