"""Publishes what happens on ~state (rapp_msgs/AgentState), without making whoever tells it wait."""

import queue
import threading

import rospy
from rapp_msgs.msg import AgentState

from rapp_core.trace import Happening

KINDS = {
    "entered": AgentState.ENTERED,
    "left": AgentState.LEFT,
    "failed": AgentState.FAILED,
    "said": AgentState.SAID,
    "heard": AgentState.HEARD,
    "message": AgentState.MESSAGE,
}


class StatePublisher:
    """A thread that publishes happenings in their order; the last one is latched for late subscribers."""

    def __init__(self) -> None:
        self._publisher = rospy.Publisher("~state", AgentState, queue_size=1000, latch=True)
        self._waiting: queue.Queue[tuple[rospy.Time, Happening] | None] = queue.Queue(maxsize=10_000)
        self._thread = threading.Thread(target=self._publish, name="state", daemon=True)
        self._thread.start()

    def tell(self, happening: Happening) -> None:
        """Queue one happening; dropped when ten thousand wait, rather than delaying the robot."""
        if not self._waiting.full():
            self._waiting.put_nowait((rospy.Time.now(), happening))

    def close(self) -> None:
        """Publish what waits, then end."""
        self._waiting.put(None)
        self._thread.join(2)

    def _publish(self) -> None:
        while (told := self._waiting.get()) is not None:
            stamp, happening = told
            self._publisher.publish(
                stamp=stamp,
                agent=happening.agent,
                machine=happening.machine,
                state=happening.state,
                kind=KINDS[happening.kind],
                detail=happening.detail,
            )
