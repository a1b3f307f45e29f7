"""Joining ROS: bounded, logging left alone."""

import logging
import sys
import threading

import rosgraph
import rospy

_log = logging.getLogger(__name__)
AGAIN = 0.5  # s between tries while there is no master
FORMAT = "%(asctime)s %(name)s %(levelname)s %(message)s"


def log_to_stderr() -> None:
    """Log what this process does on stderr; rospy puts its own handlers in place when it joins, so it is called again then."""
    logging.basicConfig(level=logging.INFO, format=FORMAT, stream=sys.stderr, force=True)


def join(name: str, stop: threading.Event) -> bool:
    """Become a node once there is a master; gives False when `stop` was set before that."""
    warned = False
    while not rosgraph.is_master_online():
        if not warned:
            _log.warning("cannot reach the ROS master at %s: waiting for it; start roscore", rosgraph.get_master_uri())
            warned = True
        if stop.wait(AGAIN):
            return False
    rospy.init_node(name, disable_signals=True, disable_rosout=True)
    log_to_stderr()
    return True


def leave() -> None:
    """Withdraw the node from the master."""
    rospy.signal_shutdown("the core agent ends")
