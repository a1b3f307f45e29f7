"""Joining ROS: bounded, logging left alone."""

import logging
import queue
import sys
import threading

import rosgraph
import rospy

from rapp_core.errors import Unreachable

_log = logging.getLogger(__name__)
STEP = 0.05  # s between two looks
MASTER = 0.3  # s between two looks for a master
FAREWELL = 1.0  # s
FORMAT = "%(asctime)s %(name)s %(levelname)s %(message)s"


def log_to_stderr() -> None:
    """Log what this process does on stderr; rospy puts its own handlers in place when it joins, so it is called again then."""
    logging.basicConfig(level=logging.INFO, format=FORMAT, stream=sys.stderr, force=True)


def join(name: str, stop: threading.Event) -> bool:
    """Become a node once there is a master; gives False when `stop` was set before that. Raises Unreachable."""
    outcome: queue.SimpleQueue[rospy.ROSException | None] = queue.SimpleQueue()
    threading.Thread(target=_enter, args=(name, stop, outcome), name="join", daemon=True).start()
    while not stop.is_set():
        try:
            error = outcome.get(timeout=STEP)
        except queue.Empty:
            continue
        if error is not None:
            raise Unreachable(f"cannot join ROS: {error}; see ROS_MASTER_URI and ROS_IP") from error
        log_to_stderr()
        return True
    return False


def _enter(name: str, stop: threading.Event, outcome: "queue.SimpleQueue[rospy.ROSException | None]") -> None:
    """rospy itself waits for a master only when there is something to register, and fails at once when there is nothing yet."""
    if not rosgraph.is_master_online():
        _log.warning("cannot reach the ROS master at %s: waiting for it; start roscore", rosgraph.get_master_uri())
        while not rosgraph.is_master_online():
            if stop.wait(MASTER):
                return
    try:
        rospy.init_node(name, disable_signals=True, disable_rosout=True)
        rospy.on_shutdown(lambda: _ended_from_outside(stop))
        outcome.put(None)
    except rospy.ROSException as error:
        outcome.put(error)


def _ended_from_outside(stop: threading.Event) -> None:
    """The master ends a node when another one comes under its name: without its services this one is of no use any more."""
    if not stop.is_set():
        _log.error("cannot go on as %s: another node has taken the name, or has ended this one; see rosnode list", rospy.get_name())
        stop.set()


def leave() -> bool:
    """Withdraw the node from the master; gives False when the master does not take the farewell in time."""
    leaving = threading.Thread(target=rospy.signal_shutdown, args=("the core agent ends",), name="leave", daemon=True)
    leaving.start()
    leaving.join(FAREWELL)
    return not leaving.is_alive()
