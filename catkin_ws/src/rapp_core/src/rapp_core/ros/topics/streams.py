"""Topics that are produced only while somebody subscribes, each at its own rate."""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from rapp_core.errors import CoreError

IDLE = 0.1  # s between two looks for subscribers
AGAIN = 1.0  # s before the next try when the robot does not answer

_log = logging.getLogger(__name__)


class Publisher(Protocol):
    """What a stream needs of rospy.Publisher."""

    def get_num_connections(self) -> int: ...  # noqa: D102 - as rospy.Publisher
    def publish(self, message: Any) -> None: ...  # noqa: D102


@dataclass(frozen=True)
class Topic:
    """One topic: its publisher, and how its message is made from what was measured."""

    publisher: Publisher
    message: Callable[[Any], Any]

    @property
    def wanted(self) -> bool:
        """Whether somebody subscribes."""
        return self.publisher.get_num_connections() > 0


class Stream:
    """A measurement that feeds topics: one thread, which measures once per period, and only while a topic is wanted."""

    def __init__(
        self, name: str, period: float, measure: Callable[[], Any], topics: Sequence[Topic], idle: Callable[[], None]
    ) -> None:
        """Prepare; `period` in s. `measure` may raise CoreError: then it is tried again later.

        `idle` is called when the last subscriber has gone.
        """
        self._name = name
        self._period = period
        self._measure = measure
        self._topics = tuple(topics)
        self._idle = idle
        self._wanted = False
        self._stop = threading.Event()
        self._lost = False
        self._bugs: set[type[Exception]] = set()  # those that have been logged
        self._thread = threading.Thread(target=self._run, name=f"stream {name}", daemon=True)

    def start(self) -> None:
        """Start; undone by `close`."""
        self._thread.start()

    def close(self) -> None:
        """End; a measurement under way is waited for, up to 1 s."""
        self._stop.set()
        self._thread.join(1)

    def _run(self) -> None:
        due = time.monotonic()
        while not self._stop.wait(max(0.0, due - time.monotonic())):
            due = max(due + self.step(), time.monotonic())

    def step(self) -> float:
        """Measure and publish what is wanted; gives the s until the next step."""
        wanted = [topic for topic in self._topics if topic.wanted]
        if not wanted:
            if self._wanted:
                self._idle()
            self._wanted = False
            return IDLE
        self._wanted = True
        try:
            measured = self._measure()
        except CoreError as error:
            self._note(error)
            return AGAIN
        except Exception as error:  # noqa: BLE001 - an odd answer of the robot must not end the topics for ever
            self._note_bug(error)
            return self._period
        self._note(None)
        for topic in wanted:
            try:
                topic.publisher.publish(topic.message(measured))
            except Exception as error:  # noqa: BLE001 - nor the other topics
                self._note_bug(error)
        return self._period

    def _note_bug(self, error: Exception) -> None:
        if type(error) not in self._bugs:
            self._bugs.add(type(error))
            _log.error("%s: a measurement is left out for a fault of ours; report it with this log", self._name, exc_info=error)

    def _note(self, error: CoreError | None) -> None:
        if error is not None and not self._lost:
            _log.warning("%s stands still: %s", self._name, error)
        self._lost = error is not None
