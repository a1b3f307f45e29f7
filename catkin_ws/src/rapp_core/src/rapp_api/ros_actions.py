"""Clients of the core agent's actions: actionlib's own, known to the core agent by a header that the gate fills in."""

import threading
from collections.abc import Mapping
from typing import Any

import rapp_msgs.msg
import rospy
from actionlib import SimpleActionClient
from actionlib_msgs.msg import GoalID
from rospy.impl.registration import Registration
from rospy.topics import _PublisherImpl, get_topic_manager

from rapp_api.core_agent import activity
from rapp_api.errors import Invalid

ACTIONS = {
    "rapp_move_to": "MoveTo",
    "rapp_move_along_path": "MoveAlongPath",
    "rapp_take_predefined_posture": "TakePosture",
    "rapp_move_joint": "MoveJoint",
}
"""Types of rapp_msgs/action by name."""


class ActionClient(SimpleActionClient):  # type: ignore[misc]  # actionlib carries no types
    """An ordinary SimpleActionClient; while its functions wait, the core agent is told that this RApp's loop does."""

    def __init__(self, name: str, header: Mapping[str, str]) -> None:
        """Raise Invalid for a name that is no action's."""
        if name not in ACTIONS:
            raise Invalid(f"cannot make a client of {name}: actions are {', '.join(ACTIONS)}")
        action = getattr(rapp_msgs.msg, f"{ACTIONS[name]}Action")
        _announce(f"{name}/goal", getattr(rapp_msgs.msg, f"{ACTIONS[name]}ActionGoal"), header)
        _announce(f"{name}/cancel", GoalID, header)
        self._sending = threading.RLock()
        super().__init__(name, action)

    def send_goal(self, goal: Any, done_cb: Any = None, active_cb: Any = None, feedback_cb: Any = None) -> None:
        """As actionlib's, which loses the end of a goal that comes before it has noted that it has sent it."""
        with self._sending:
            super().send_goal(goal, done_cb, active_cb, feedback_cb)

    def _handle_transition(self, handle: Any) -> None:
        with self._sending:  # until the goal that is being sent is noted
            super()._handle_transition(handle)

    def wait_for_server(self, timeout: Any = None) -> bool:
        """As actionlib's; no time-out waits for ever."""
        with activity.waiting():
            return bool(super().wait_for_server(timeout or rospy.Duration()))

    def wait_for_result(self, timeout: Any = None) -> bool:
        """As actionlib's; no time-out waits for ever."""
        with activity.waiting():
            return bool(super().wait_for_result(timeout or rospy.Duration()))


def _announce(topic: str, cls: Any, header: Mapping[str, str]) -> None:
    """Have rospy publish a topic with a header from its first connection on.

    rospy.Publisher takes a header too, but puts it in place after it has told the master: who connects at once would miss it.
    """
    manager, name = get_topic_manager(), rospy.resolve_name(topic)
    with manager.lock:
        if manager.get_publisher_impl(name) is None:
            impl = _PublisherImpl(name, cls)
            impl.add_headers(header)
            manager._add(impl, manager.pubs, Registration.PUB)
